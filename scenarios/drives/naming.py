"""Names of experiments: what two drives share that differ in the seed only."""

from collections.abc import Mapping


def pair_name(reference: Mapping[str, str], query: Mapping[str, str]) -> str:
    """World, lights, and where the query differs in route or from the plan, by the drives' metadata."""
    lights = [str(drive.get("light", "")) for drive in (reference, query)]
    worlds = dict.fromkeys(str(drive.get("world", "")) for drive in (reference, query))
    parts = [" → ".join(world for world in worlds if world), " → ".join(lights) if all(lights) else ""]
    if (route := query.get("route", "")) != reference.get("route", ""):
        parts.append(route)
    changes = [str(drive.get("change", "none")) for drive in (reference, query)]
    if changes != ["none", "none"]:
        parts.append(f"change {changes[1]}" if changes[0] == "none" else f"change {changes[0]} → {changes[1]}")
    return ", ".join(str(part) for part in parts if part) or "drives of unknown light"
