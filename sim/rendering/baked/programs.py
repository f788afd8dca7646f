"""The device's programs: how far off what the sun sees is, and what a camera sees."""

from dataclasses import dataclass
from typing import Any

HEAD = "#version 330\n"
SUNNY = HEAD + "#define SUNNY\n"

DEPTH_VERTICES = """
uniform mat4 onto_map;
in vec3 place;
void main() { gl_Position = onto_map * vec4(place, 1.0); }
"""

DEPTH_FRAGMENTS = """
void main() {}
"""

VERTICES = """
uniform mat4 into_camera;
uniform mat4 onto_picture;
in vec3 place;
in vec3 normal;
in vec2 uv;
in vec2 chart;  // place on the sheet [texels]; 0: not on it
in vec4 look;  // illuminance [lx], albedo, emission [cd/m2], share of its distance by which it comes nearer
out vec2 on_picture;
out vec2 on_sheet;
out vec3 shown;

#ifdef SUNNY
uniform mat4 onto_still_map;
uniform mat4 onto_moving_map;
uniform vec2 texels;  // sides of the maps' texels [m]
uniform vec3 towards_sun;
out vec3 on_still_map;
out vec3 on_moving_map;
out float cosine;

vec3 on_map(mat4 onto_map, float texel) {
    return (onto_map * vec4(place + 1.5 * texel * normal, 1.0)).xyz * 0.5 + 0.5;
}
#endif

void main() {
    on_picture = uv;
    on_sheet = chart;
    shown = look.xyz;
    vec4 seen = into_camera * vec4(place, 1.0);
    // Along its ray to the eye: at the same pixel, before the wall on which it hangs.
    gl_Position = onto_picture * vec4(seen.xyz * (1.0 - look.w), 1.0);
#ifdef SUNNY
    cosine = dot(normal, towards_sun);
    on_still_map = on_map(onto_still_map, texels.x);
    on_moving_map = on_map(onto_moving_map, texels.y);
#endif
}
"""

FRAGMENTS = """
const float PI = 3.14159265358979;
uniform sampler2D picture;
uniform sampler2D sheet;  // illuminance but the direct sun's [lx]
in vec2 on_picture;
in vec2 on_sheet;
in vec3 shown;
out float luminance;

#ifdef SUNNY
uniform sampler2DShadow still_map;
uniform sampler2DShadow moving_map;
uniform float sun;  // on what faces it [lx]
in vec3 on_still_map;
in vec3 on_moving_map;
in float cosine;
#endif

void main() {
    float falling = shown.x + texture(sheet, on_sheet / vec2(textureSize(sheet, 0))).r;
#ifdef SUNNY
    falling += sun * max(cosine, 0.0) * texture(still_map, on_still_map) * texture(moving_map, on_moving_map);
#endif
    luminance = texture(picture, on_picture).r * (shown.y * falling / PI + shown.z);
}
"""


@dataclass(frozen=True, slots=True)
class Programs:
    """The device's ``context``, and what draws a ``picture``, ``sunny`` or not, and a sun map's ``depth``."""

    context: Any
    sunny: bool
    picture: Any
    depth: Any

    @classmethod
    def of(cls, context: Any, *, sunny: bool) -> "Programs":
        """Make them on a device; one for pictures without a sun is quicker than one with."""
        head = SUNNY if sunny else HEAD
        picture = context.program(vertex_shader=head + VERTICES, fragment_shader=head + FRAGMENTS)
        depth = context.program(vertex_shader=HEAD + DEPTH_VERTICES, fragment_shader=HEAD + DEPTH_FRAGMENTS)
        return cls(context, sunny, picture, depth)
