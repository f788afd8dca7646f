"""Lookout: the camera's search for the landmark that a mission seeks."""

from refseq.missions.executor import Executor
from refseq.missions.plan import Sought
from refseq.scenes import SceneApproach, SceneFinder
from refseq.view import View


class Lookout:
    """Looks in the views of a mission's ``executor`` for the scene that is sought, and tells it when it is seen.

    ``sees`` is True while it was in the last view. Raises ``SceneError`` for a scene with too few keys, of whichever
    step, before the robot moves.
    """

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        scenes = {} if executor.plan.sought is None else executor.plan.sought.landmarks.scenes
        self._finders = {name: SceneFinder(scene) for name, scene in scenes.items()}
        self._sought: Sought | None = None
        self._approach: SceneApproach | None = None
        self.sees = False

    @property
    def looks(self) -> bool:
        """True where there is something to look for."""
        return self._executor.sought is not None

    def check(self, view: View) -> None:
        """Raise ``SceneError`` where a scene is of a camera that the view lacks, or of pictures of another size."""
        for finder in self._finders.values():
            finder.scene.check_camera(view)

    def look(self, view: View) -> None:
        """Look in a view that was taken here and now."""
        sought, self.sees = self._executor.sought, False
        if sought is None:
            return
        if self._approach is None or sought is not self._sought:
            self._sought, self._approach = sought, SceneApproach(sought.scene)
        sighting = self._finders[sought.name].find(view)
        self.sees = sighting is not None
        left = self._approach.update(sighting, self._executor.travelled)
        if left is not None:
            self._executor.sight(left)
