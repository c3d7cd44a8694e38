import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

class Map:
    def __init__(
        self, array: npt.ArrayLike, resolution: float, origin: Sequence[float] = (0.0, 0.0)
    ) -> None: ...
    @staticmethod
    def load(
        file: Union[str, os.PathLike[str]],
        resolution: Optional[float] = None,
        origin: Optional[Sequence[float]] = None,
    ) -> Map: ...
    @property
    def array(self) -> npt.NDArray[np.float32]: ...
    @property
    def resolution(self) -> float: ...
    @property
    def origin(self) -> List[float]: ...
    @property
    def extent(self) -> Tuple[float, float, float, float]: ...

class Sweep:
    def __init__(
        self,
        beam_step: float,
        first_beam: float = 0.0,
        times: Sequence[float] = (),
        poses: Optional[npt.ArrayLike] = None,
    ) -> None: ...
    @staticmethod
    def of_twist(beam_step: float, twist: Sequence[float], *, first_beam: float = 0.0) -> Sweep: ...
    @property
    def beam_step(self) -> float: ...
    @property
    def first_beam(self) -> float: ...

class Localization:
    @property
    def status(self) -> str: ...
    @property
    def confidence(self) -> float: ...
    @property
    def note(self) -> str: ...
    @property
    def relative_entropy(self) -> Optional[float]: ...
    @property
    def pose(self) -> Optional[npt.NDArray[np.float64]]: ...
    @property
    def map(self) -> str: ...
    @property
    def maps(self) -> List[str]: ...
    @property
    def poses(self) -> npt.NDArray[np.float64]: ...
    @property
    def covariances(self) -> npt.NDArray[np.float64]: ...
    @property
    def probabilities(self) -> npt.NDArray[np.float64]: ...
    @property
    def explained(self) -> npt.NDArray[np.float64]: ...
    @property
    def total_ms(self) -> float: ...

class Localizer:
    def __init__(
        self,
        map: Map,
        parameters: Union[None, str, os.PathLike[str], Mapping[str, object]] = None,
        threads: int = 1,
    ) -> None: ...
    def localize(
        self,
        ranges: npt.ArrayLike,
        angle_min: float,
        angle_increment: float,
        max_range: float,
        sensor_pose: Sequence[float] = (),
        region: Optional[Sequence[float]] = None,
        *,
        min_range: float = 0.0,
        time_budget: float = 0.0,
        sweep: Optional[Sweep] = None,
    ) -> Localization: ...
    def to_ini(self) -> str: ...

class Atlas:
    def __init__(
        self, localizers: Mapping[str, Localizer], regions: Mapping[str, Sequence[float]] = ...
    ) -> None: ...
    @staticmethod
    def load(
        path: Union[str, os.PathLike[str]],
        parameters: Union[None, str, os.PathLike[str], Mapping[str, object]] = None,
    ) -> Atlas: ...
    def localize(
        self,
        ranges: npt.ArrayLike,
        angle_min: float,
        angle_increment: float,
        max_range: float,
        sensor_pose: Sequence[float] = (),
        *,
        min_range: float = 0.0,
        time_budget: float = 0.0,
        sweep: Optional[Sweep] = None,
    ) -> Localization: ...
    @property
    def names(self) -> List[str]: ...

class Tracker:
    @overload
    def __init__(self, localizer: Localizer, region: Optional[Sequence[float]] = None) -> None: ...
    @overload
    def __init__(self, atlas: Atlas) -> None: ...
    def add(
        self,
        time: float,
        ranges: npt.ArrayLike,
        angle_min: float,
        angle_increment: float,
        max_range: float,
        sensor_pose: Sequence[float] = (),
        motion: Optional[Sequence[float]] = None,
        *,
        min_range: float = 0.0,
        sweep: Optional[Sweep] = None,
    ) -> Localization: ...
    def after(
        self, motion: Optional[Sequence[float]] = None, seconds: float = 0.0
    ) -> Optional[Tuple[npt.NDArray[np.float64], float]]: ...
    def suggest(self, pose: Sequence[float], std: Sequence[float] = (0.5, 0.26), map: str = "") -> None: ...
    @property
    def suggestion(self) -> str: ...

class WindowLocalizer:
    @overload
    def __init__(
        self, localizer: Localizer, frames: int = 10, region: Optional[Sequence[float]] = None
    ) -> None: ...
    @overload
    def __init__(self, atlas: Atlas, frames: int = 10) -> None: ...
    def add(
        self,
        ranges: npt.ArrayLike,
        angle_min: float,
        angle_increment: float,
        max_range: float,
        sensor_pose: Sequence[float] = (),
        motion: Optional[Sequence[float]] = None,
        *,
        min_range: float = 0.0,
        sweep: Optional[Sweep] = None,
    ) -> Localization: ...

def calibrate(
    localizer: Localizer,
    ranges: Sequence[npt.ArrayLike],
    times: Sequence[float],
    poses: npt.ArrayLike,
    angle_min: float,
    angle_increment: float,
    max_range: float,
    odometry_times: Sequence[float],
    odometry: npt.ArrayLike,
    sensor_pose: Sequence[float] = (),
    *,
    sweep_time: Sequence[float] = (0.0, 0.0),
) -> Dict[str, Any]: ...
