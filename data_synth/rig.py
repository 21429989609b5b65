"""The bench: a camera looking down, a projector from the side, and every optical and electronic fault with its unit."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from deskew.errors import require, require_whole
from deskew.types import Floats, Pinhole, Size

BASELINE_MM = 426.0
"""Distance of projector and camera along X in the default rig."""

_CAMERA_AT = (6.0, -5.0, 800.0)


@dataclass(frozen=True, slots=True)
class RigConfig:
    """Optics, light and sensor. The camera's response is linear in light; there is no defocus and no interreflection.

    Attributes
    ----------
    camera_psf_sigma_px : float
        Gaussian blur of the lens, camera pixels.
    projector_blur_sigma_px : float
        Gaussian blur of the projector's image, projector pixels.
    stripe_width_px : int
        Neighbouring projector lines that a frame of a sweep lights, odd: frame i is centred on line i.
    projector_gamma : float
        Light of a code c is ``(c / 255) ** gamma`` of full light.
    projector_code : int
        Code of every lit projector pixel, 1 to 255.
    driver_gamma : float
        Exponent that the projector's driver takes off: for a share s of the lit pixels' light it sends the code
        ``projector_code * s ** (1 / driver_gamma)``, rounded. Unlike `projector_gamma`, and the fringes are no sines.
    projector_contrast : float
        Full light over the light that leaks at code 0.
    exposure_grey : float
        Grey levels of a perfectly white diffuser on the bed under full projector light at the world's origin.
    ambient : float
        Light of an even sky, as a share of the projector's full light on the bed.
    pedestal_grey : float
        Grey level of no light at all.
    desk_albedo : float
        Reflectance of the bed around the page.
    shot_noise_grey : float
        Noise variance per grey level of signal [grey levels].
    read_noise_grey : float
        Standard deviation of the noise at no signal [grey levels].
    noise_scale : float
        Factor on the standard deviation of shot and read noise together; 0 leaves the 8-bit rounding alone.
    noise_draw : int
        Which draw of that noise, at least 0: another one photographs the same scene with other noise.
    exposures : int
        Exposures that the camera averages into one image, 1 to 256; from two on images have 16 bits. A line sweep takes
        one.
    late_share_max : float
        Projector and camera out of step: the largest share of an exposure during which the projector still shows the
        frame before (black before the first), drawn evenly from 0 to this for each frame.
    repeated_share : float
        Share of the frames in whose stead the camera catches the frame before once more.
    """

    camera_psf_sigma_px: float = 0.75
    projector_blur_sigma_px: float = 0.6
    stripe_width_px: int = 1
    projector_gamma: float = 2.2
    projector_code: int = 235
    driver_gamma: float = 2.2
    projector_contrast: float = 500.0
    exposure_grey: float = 235.0
    ambient: float = 0.03
    pedestal_grey: float = 4.0
    desk_albedo: float = 0.03
    shot_noise_grey: float = 0.017
    read_noise_grey: float = 0.8
    noise_scale: float = 1.0
    noise_draw: int = 0
    exposures: int = 1
    late_share_max: float = 0.0
    repeated_share: float = 0.0

    def __post_init__(self) -> None:
        for item in fields(self):
            value = getattr(self, item.name)
            require(bool(np.isfinite(value)) and value >= 0, item.name, "be finite and not negative", value)
        for name, low, high in (
            ("camera_psf_sigma_px", 0.3, 3.0),
            ("projector_blur_sigma_px", 0.2, 3.0),
            ("projector_gamma", 0.5, 4.0),
            ("projector_code", 1, 255),
            ("driver_gamma", 0.5, 4.0),
            ("projector_contrast", 2, np.inf),
            ("desk_albedo", 0, 1),
            ("late_share_max", 0, 1),
            ("repeated_share", 0, 1),
        ):
            value = getattr(self, name)
            require(low <= value <= high, name, f"be in [{low}, {high}]", value)
        require_whole("noise_draw", self.noise_draw, 0, 2**32 - 1)
        require_whole("exposures", self.exposures, 1, 256)
        odd = self.stripe_width_px in range(1, 16, 2)
        require(odd, "stripe_width_px", "be an odd whole number in [1, 15]", self.stripe_width_px)

    @property
    def lit(self) -> float:
        """Light of a lit projector pixel over full light, without the leak that is always there."""
        return float((1 - self.leak) * (self.projector_code / 255) ** self.projector_gamma)

    def shown(self, asked: Floats) -> Floats:
        """Light that the projector gives where a share `asked` of a lit pixel's, in [0, 1], is sent to its driver."""
        codes = np.rint(self.projector_code * asked ** (1 / self.driver_gamma))
        return np.asarray((codes / self.projector_code) ** self.projector_gamma)

    @property
    def noise_variance(self) -> tuple[float, float]:
        """Noise variance at no signal [grey levels^2] and its growth per grey level, `noise_scale` included."""
        return self.noise_scale**2 * self.read_noise_grey**2, self.noise_scale**2 * self.shot_noise_grey

    @property
    def leak(self) -> float:
        """Light at code 0 over full light."""
        return 1 / self.projector_contrast


@dataclass(frozen=True, slots=True)
class Rig:
    """Both devices in the world, and the configuration of light and sensor.

    Attributes
    ----------
    camera, projector : Pinhole
        True devices; the pipeline has to estimate them.
    config : RigConfig
        The rest.
    """

    camera: Pinhole
    projector: Pinhole
    config: RigConfig


def look_at(
    size: Size, K: Floats, distortion: tuple[float, ...], eye: tuple[float, float, float], axis_at: tuple[float, float]
) -> Pinhole:
    """Place a device by its centre and the point of the bed where its optical axis goes; its x axis leans to +X.

    Parameters
    ----------
    size : (width, height)
        Pixels.
    K : (3, 3) array
        Intrinsics [px].
    distortion : 5 numbers
        k1, k2, p1, p2, k3.
    eye : (3,) tuple
        Centre in the world [mm].
    axis_at : (2,) tuple
        X, Y on the bed [mm].
    """
    z = np.array([*axis_at, 0.0]) - np.array(eye)
    z = z / np.linalg.norm(z)
    # Image rows run down, towards -Y.
    x = np.cross(np.array([0.0, -1.0, 0.0]), z)
    x = x / np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    return Pinhole(size, K, np.array(distortion), R, -R @ np.array(eye))


def default_camera() -> Pinhole:
    """640 x 480 at 800 mm, 0.475 mm/px on the bed, barrel distortion of about 2 px in the corners."""
    K = np.array([[1684.0, 0.0, 324.6], [0.0, 1685.5, 236.2], [0.0, 0.0, 1.0]])
    return look_at((640, 480), K, (-0.09, 0.12, 4e-4, -3e-4, 0.0), _CAMERA_AT, (2.2, 1.8))


def default_projector(baseline_mm: float = BASELINE_MM) -> Pinhole:
    """1024 x 768 from the right at about 23 degrees, 0.33 mm/px on the bed, lens shift beyond the frame's edge.

    The frame covers the page up to 60 mm above the bed. Its optical axis meets the bed in front of the page, as a
    table-top projector's does, so the principal point lies below the last row.

    Parameters
    ----------
    baseline_mm : float
        Distance to the camera along X, in [100, 700]. The projector moves on a circle about the place that it is aimed
        at, so it lights as much of the bed, as finely, from wherever it stands.
    """
    require(100 <= baseline_mm <= 700, "baseline_mm", "be in [100, 700]", baseline_mm)
    K = np.array([[3276.0, 0.0, 511.3], [0.0, 3273.0, 837.0], [0.0, 0.0, 1.0]])
    axis_at, squared_mm = (-9.0, -135.0), 441.0**2 + 985.0**2
    x = _CAMERA_AT[0] + baseline_mm
    eye = (x, axis_at[1], float(np.sqrt(squared_mm - (x - axis_at[0]) ** 2)))
    return look_at((1024, 768), K, (0.035, -0.02, -3e-4, 5e-4, 0.0), eye, axis_at)


def default_rig(noise_scale: float = 1.0, *, baseline_mm: float = BASELINE_MM) -> Rig:
    """Return the bench of every experiment; `noise_scale` multiplies the sensor's noise."""
    return Rig(default_camera(), default_projector(baseline_mm), RigConfig(noise_scale=noise_scale))
