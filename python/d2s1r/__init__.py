"""One-shot global localization with a 2D LiDAR: where in a map was a scan taken?

    localizer = d2s1r.Localizer(d2s1r.Map.load("building.yaml"))
    result = localizer.localize(ranges, angle_min, angle_increment, max_range)
    if result.status == "localized":
        x, y, phi = result.pose
"""

from ._d2s1r import Atlas, Localization, Localizer, Map, Sweep, Tracker, WindowLocalizer, __version__

__all__ = ["Atlas", "Localization", "Localizer", "Map", "Sweep", "Tracker", "WindowLocalizer"]
