"""Further images through the same optics: other lamps, other formats of the same sensor (sections 2.4 and 4)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from data_synth.exposure import exposed
from data_synth.manuscript import Layer, Manuscript
from data_synth.optics import blurred, margin_px, psf_taps
from data_synth.pages import Page
from data_synth.rig import Rig, look_at
from data_synth.shading import sample_scene
from data_synth.sheets import TrueSheet
from deskew.errors import require
from deskew.types import Floats, Pinhole, Size

_LAMP_MM = 1500.0
# Noise of further images: far beyond the number of any frame of a sweep.
_FIRST_TEXTURE = 1 << 20


@dataclass(frozen=True, slots=True)
class Format:
    """How the sensor is read out for a texture: a pixel (x, y) of the scan lies at ``scale * (x, y) + offset`` there.

    Attributes
    ----------
    size : (width, height)
        Pixels of the texture; their aspect need not be the scan's.
    scale, offset : (2,) tuples
        Pixels of the texture a pixel of the scan, and where the scan's pixel (0, 0) lies [texture px].
    psf_sigma_px : float
        Gaussian blur of the lens [texture px].
    """

    size: Size
    scale: tuple[float, float]
    offset: tuple[float, float]
    psf_sigma_px: float = 0.75

    def __post_init__(self) -> None:
        require(min(self.size) >= 2, "size", "be at least 2 x 2", self.size)
        require(min(self.scale) > 0, "scale", "be positive", self.scale)

    @property
    def from_scan(self) -> Floats:
        """Scan pixel to texture pixel, (2, 3)."""
        return np.array([[self.scale[0], 0.0, self.offset[0]], [0.0, self.scale[1], self.offset[1]]])

    def camera(self, camera: Pinhole) -> Pinhole:
        """Return the camera with this format: the same lens, so the same distortion."""
        K = self.from_scan[:, :2] @ camera.K[:2] + np.outer(self.from_scan[:, 2], camera.K[2])
        return replace(camera, size=self.size, K=np.vstack([K, camera.K[2]]))


@dataclass(frozen=True, slots=True)
class Light:
    """A lamp apart from the projector, and what of the page it brings out.

    Attributes
    ----------
    name : str
        Of the texture.
    layer : Layer
        What of a manuscript answers to it; other pages answer every light by their print.
    direct, even : float
        Grey levels that a white diffuser on the bed at the world's origin gets from the lamp, and from all round.
    azimuth_deg, elevation_deg : float
        Where the lamp stands 1.5 m from the origin, counter-clockwise from +X and above the bed.
    desk : float or None
        What the bed gives back, as the page's layer does; None for the rig's own desk.
    readout : Format or None
        None for the scan's own pixels.
    """

    name: str
    layer: Layer = Layer.REFLECTANCE
    direct: float = 0.0
    even: float = 0.0
    azimuth_deg: float = 180.0
    elevation_deg: float = 90.0
    desk: float | None = None
    readout: Format | None = None

    def __post_init__(self) -> None:
        require(min(self.direct, self.even) >= 0, "direct", "be not negative, as even", (self.direct, self.even))
        require(0 < self.elevation_deg <= 90, "elevation_deg", "be in (0, 90]", self.elevation_deg)

    @property
    def lamp(self) -> Pinhole:
        """The lamp as a spot aimed at the origin: like a projector's, its light is even across its axis."""
        azimuth, elevation = np.radians([self.azimuth_deg, self.elevation_deg])
        flat, high = _LAMP_MM * np.cos(elevation), _LAMP_MM * np.sin(elevation)
        eye = float(flat * np.cos(azimuth)), float(flat * np.sin(azimuth)), float(high)
        # 400 mm to each side of the origin at 1.5 px a millimetre: the page with its relief, as the shadows need it.
        K = np.array([[1.5 * _LAMP_MM, 0.0, 600.0], [0.0, 1.5 * _LAMP_MM, 600.0], [0.0, 0.0, 1.0]])
        return look_at((1201, 1201), K, (0.0,) * 5, eye, (0.0, 0.0))


def standard_lights(readout: Format | None = None) -> tuple[Light, ...]:
    """Return the lights of section 2.1 in one format: a lamp from above, raking, ultra-violet and back-light.

    The ultra-violet lamps glow all round and give little light, the others use the sensor's range. Under ultra-violet
    the desk stays dark; the light panel under the page ends at its border, where a mask keeps it from dazzling.
    """
    return (
        Light("above", direct=150.0, even=50.0, azimuth_deg=100.0, elevation_deg=75.0, readout=readout),
        Light("raking", Layer.RELIEF, direct=85.0, even=8.0, elevation_deg=18.0, readout=readout),
        Light("uv", Layer.FLUORESCENCE, even=140.0, desk=0.02, readout=readout),
        Light("backlight", Layer.TRANSMITTANCE, even=300.0, desk=0.01, readout=readout),
    )


def under_lights(
    rig: Rig, sheet: TrueSheet, page: Page, lights: Sequence[Light], key: int
) -> dict[str, npt.NDArray[np.uint8]]:
    """Photograph a sheet under each light: 8-bit images by name.

    Parameters
    ----------
    rig : Rig
        The bench; its projector is off.
    sheet, page : TrueSheet, Page
        As in :func:`data_synth.photograph`.
    lights : sequence of Light
        Of different names.
    key : int
        Of the sensor's noise.
    """
    names = [light.name for light in lights]
    require(len(set(names)) == len(names), "lights", "have different names", names)
    return {light.name: _under(rig, sheet, page, light, key, _FIRST_TEXTURE + i) for i, light in enumerate(lights)}


def _under(rig: Rig, sheet: TrueSheet, page: Page, light: Light, key: int, frame: int) -> npt.NDArray[np.uint8]:
    config, camera = rig.config, rig.camera
    if light.readout is not None:
        camera = light.readout.camera(camera)
        config = replace(config, camera_psf_sigma_px=light.readout.psf_sigma_px)
    if light.desk is not None:
        config = replace(config, desk_albedo=light.desk)
    azimuth, elevation = np.radians([light.azimuth_deg, light.elevation_deg])
    if isinstance(page, Manuscript):
        # The page's v runs against the world's Y.
        page = page.under(light.layer, (float(np.cos(azimuth)), -float(np.sin(azimuth))), float(1 / np.tan(elevation)))
    sigma = config.camera_psf_sigma_px
    samples = sample_scene(Rig(camera, light.lamp, config), sheet, page, margin_px(sigma))
    radiance = np.float32(light.direct) * samples.lit + np.float32(light.even) * samples.sky
    return exposed(blurred(radiance, psf_taps(sigma)) + np.float32(config.pedestal_grey), config, key, frame)
