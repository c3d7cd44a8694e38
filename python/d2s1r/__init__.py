"""One-shot global localization with a 2D LiDAR: where in a map was a scan taken?

    localizer = d2s1r.Localizer(d2s1r.Map.load("building.yaml"))
    result = localizer.localize(ranges, angle_min, angle_increment, max_range)
    if result.status == "localized":
        x, y, phi = result.pose
"""
import difflib
import functools
import re

from ._d2s1r import Atlas, Localization, Localizer, Map, Sweep, Tracker, WindowLocalizer, __version__, calibrate

__all__ = ["Atlas", "Localization", "Localizer", "Map", "Sweep", "Tracker", "WindowLocalizer", "calibrate"]


def _what_is_wrong(name, text, given):
    """One line about arguments that fit to none of the signatures that pybind11 lists in `text`."""
    signatures = re.findall(r"^ +\d+\. .*?\((.*)\)(?: -> .*)?$", text, re.MULTILINE)
    known = dict.fromkeys(word for signature in signatures for word in re.findall(r"(\w+): ", signature))
    known.pop("self", None)
    for keyword in given:
        if keyword not in known:
            nearest = difflib.get_close_matches(keyword, known, 1)
            return f"{name}() has no argument '{keyword}'" + (f"; did you mean '{nearest[0]}'?" if nearest else "; it takes " + ", ".join(known))
    return f"{name}() does not take these arguments; it takes " + ", ".join(known) + f"; see help(d2s1r.{name})"


def _in_one_line(name, function):
    """The same function, whose TypeError is one line instead of a list of overloads."""

    @functools.wraps(function)
    def call(*arguments, **keywords):
        try:
            return function(*arguments, **keywords)
        except TypeError as error:
            if "incompatible" not in str(error):
                raise
            reason = _what_is_wrong(name, str(error), keywords)
        raise TypeError(reason)

    return call


calibrate = _in_one_line("calibrate", calibrate)
for _class in (Atlas, Localizer, Map, Sweep, Tracker, WindowLocalizer):
    for _name, _value in list(vars(_class).items()):
        _shown = _class.__name__ + ("" if _name == "__init__" else "." + _name)
        if isinstance(_value, staticmethod):
            setattr(_class, _name, staticmethod(_in_one_line(_shown, _value.__func__)))
        elif type(_value).__name__ == "instancemethod" and (_name == "__init__" or not _name.startswith("_")):
            setattr(_class, _name, _in_one_line(_shown, _value))
