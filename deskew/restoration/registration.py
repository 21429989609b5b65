"""Where a texture of another format shows what the scan's camera saw, found from the two images alone.

The high-resolution image and the video signal come through one lens (section 4), so a pixel of one lies at
``scale * pixel + offset`` of the other: formats differ in sampling, aspect and crop, which nobody states. A search over
scales and shifts starts; then many small patches say how far each is off, whatever light either image was taken in, and
the map is fitted to what they say. They are far more than the map's four numbers, so they also say how well it fits.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from deskew.errors import StepError, require
from deskew.restoration.sampling import read_at
from deskew.types import Array, Floats

# The search: width of the scan it is done at [px], scales tried about the one that the widths suggest.
SEARCH_WIDTH_PX = 160
SCALES = np.geomspace(0.5, 2.0, 48)
ASPECT_STEPS = (0.03, 0.01, 0.003)
# Side of a patch [scan px], and steps of the refinement; a patch may ask for this much in one step.
PATCH_PX, PATCH_COARSE_PX, N_STEPS, STEP_MAX_PX = 32, 16, 20, 3.0
# Images that show the same page agree better than this: correlation of a patch in the median, patches off by [scan px].
CORRELATION_MIN, RESIDUAL_MAX_PX = 0.8, 0.25
N_PATCHES_MIN = 12


@dataclass(frozen=True, slots=True)
class Registration:
    """The map from the scan's pixels to a texture's, and how sure it is.

    Attributes
    ----------
    scale, offset : (2,) arrays
        A scan pixel (x, y) lies at ``scale * (x, y) + offset`` [texture px].
    residual_px : float
        How far the patches lie off the map, root mean square weighted by how well each is placed [texture px].
    uncertainty_px : float
        Error to be expected of the map itself, root mean square over the picture [texture px].
    correlation : float
        Of the two images in a patch, median.
    n_patches : int
        Patches that agree with the map.
    """

    scale: Floats
    offset: Floats
    residual_px: float = 0.0
    uncertainty_px: float = 0.0
    correlation: float = 1.0
    n_patches: int = 0

    def to_texture(self, pixels: Floats) -> Floats:
        """Carry scan pixels (..., 2) to texture pixels."""
        return np.asarray(pixels * self.scale + self.offset)


def register(texture: Array, scan: Array, name: str = "texture") -> Registration:
    """Find the map from the scan's pixels to the texture's, to a fraction of a texture pixel.

    Parameters
    ----------
    texture : (h, w[, channels]) array
        Another format of the same view, under any light that shows some of what the scan shows.
    scan : (height, width[, channels]) array
        The scan's white image.
    name : str
        What an error calls the texture.

    Returns
    -------
    Registration

    Raises
    ------
    InputError
        If an image is no picture, or smaller than 64 pixels.
    StepError
        If the two do not show the same page, or show too little of it.
    """
    for label, image in ((name, texture), ("scan", scan)):
        picture = image.ndim in (2, 3) and min(image.shape[:2]) >= 64
        require(picture, label, "be an image of at least 64 x 64 pixels", image.shape)
    source, target = grey(texture), grey(scan)
    scale, offset = _searched(source, target)
    start = _refined(source, target, scale, offset, 4)
    middle = _refined(source, target, start.scale, start.offset, 2)
    found = _refined(source, target, middle.scale, middle.offset, 1)
    limit = RESIDUAL_MAX_PX * float(found.scale.mean())
    fits = found.correlation >= CORRELATION_MIN and found.residual_px <= limit and found.n_patches >= N_PATCHES_MIN
    if not fits:
        raise StepError(
            f"Registration: `{name}` does not fit the scan's white image: patches correlate by {found.correlation:.2f} "
            f"({CORRELATION_MIN} needed), {found.n_patches} agree ({N_PATCHES_MIN} needed), {found.residual_px:.2g} px "
            f"off ({limit:.2g} allowed); move nothing between the two, and light both so that the print shows."
        )
    return found


def grey(image: Array) -> Floats:
    """Return an image's mean over its channels, (height, width) float64."""
    values = image.astype(np.float64)
    return values if values.ndim == 2 else np.asarray(values.mean(axis=2))


def _edges(image: Floats) -> Floats:
    """Size of the gradient, which lights change less than grey levels, with mean 0."""
    smooth = cv2.GaussianBlur(image, (0, 0), 1.0)
    size = np.hypot(cv2.Sobel(smooth, cv2.CV_64F, 1, 0), cv2.Sobel(smooth, cv2.CV_64F, 0, 1))
    return np.asarray(size - size.mean())


def _searched(source: Floats, target: Floats) -> tuple[Floats, Floats]:
    """Scale and offset of the best match of the edges at low resolution: alike both ways first, then each its own."""
    search = _Search.of(source, target)
    likely = source.shape[1] / target.shape[1]
    best = max((search.match(likely * s, likely * s) for s in SCALES), key=lambda match: match[0])
    for spread in ASPECT_STEPS:
        factors = 1.0 + spread * np.arange(-2, 3)
        tried = [search.match(best[1] * a, best[2] * b) for a in factors for b in factors]
        best = max(tried, key=lambda match: match[0])
    _, sx, sy, dx, dy = best
    scale = np.array([sx, sy])
    # Pixel centres sit at integers: corners at (-1/2, -1/2) meet when the shift is 0.
    return scale, np.array([dx, dy]) + (scale - 1.0) / 2.0


@dataclass(frozen=True, slots=True)
class _Search:
    """The texture, and the edges of the scan at `coarse` times its resolution."""

    source: Floats
    wanted: Floats
    coarse: float

    @classmethod
    def of(cls, source: Floats, target: Floats) -> _Search:
        coarse = min(1.0, SEARCH_WIDTH_PX / target.shape[1])
        small = cv2.resize(target, None, fx=coarse, fy=coarse, interpolation=cv2.INTER_AREA)
        return cls(source, _edges(small), coarse)

    def match(self, sx: float, sy: float) -> tuple[float, float, float, float, float]:
        """Correlation at the best shift, the scale, and that shift [texture px]."""
        fx, fy = self.coarse / sx, self.coarse / sy
        size = max(8, round(self.source.shape[1] * fx)), max(8, round(self.source.shape[0] * fy))
        found, wanted = _edges(cv2.resize(self.source, size, interpolation=cv2.INTER_AREA)), self.wanted
        shape = [cv2.getOptimalDFTSize(a + b) for a, b in zip(found.shape, wanted.shape, strict=True)]
        spectrum = np.fft.rfft2(found, shape) * np.conj(np.fft.rfft2(wanted, shape))
        match = np.fft.irfft2(spectrum, shape) / (np.linalg.norm(found) * np.linalg.norm(wanted) + 1e-300)
        y, x = np.unravel_index(int(match.argmax()), match.shape)
        dx, dy = (i - n if i > n // 2 else i for i, n in ((int(x), shape[1]), (int(y), shape[0])))
        return float(match[y, x]), sx, sy, dx / fx, dy / fy


def _refined(source: Floats, target: Floats, scale: Floats, offset: Floats, shrink: int) -> Registration:
    """Let the patches of the scan, made smaller by `shrink`, correct the map step by step."""
    height, width = (n // shrink for n in target.shape)
    small = cv2.resize(target[: height * shrink, : width * shrink], (width, height), interpolation=cv2.INTER_AREA)
    # In pixels of the smaller scan, whose pixel (0, 0) lies at (shrink - 1) / 2.
    scale, offset = np.asarray(scale * shrink), np.asarray(offset + scale * (shrink - 1) / 2)
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    found = Registration(scale, offset)
    side = PATCH_PX if shrink == 1 else PATCH_COARSE_PX
    for _ in range(N_STEPS):
        places = np.stack([x * scale[0] + offset[0], y * scale[1] + offset[1]], axis=-1)
        inside = ((places >= 0) & (places <= np.array(source.shape[::-1]) - 1.0)).all(axis=-1)
        warped = read_at(source, places, float(scale.mean()))
        patches = _Patches.of(warped, small, np.asarray(inside, dtype=np.float64), side)
        found = _fitted(patches, scale, offset, (width, height))
        moved = np.abs(found.scale - scale).max() * width + np.abs(found.offset - offset).max()
        scale, offset = found.scale, found.offset
        if moved < 1e-3 * scale.mean():
            break
    back = scale / shrink
    return Registration(
        back, offset - back * (shrink - 1) / 2, *(getattr(found, name) for name in Registration.__slots__[2:])
    )


@dataclass(frozen=True, slots=True)
class _Patches:
    """What each patch says.

    Attributes
    ----------
    centre, shift : (N, 2) arrays
        Where it is, and how far the warped texture has to move there [scan px].
    information : (N, 2, 2) array
        Inverse covariance of the shift.
    correlation : (N,) array
        Of the images in it.
    """

    centre: Floats
    shift: Floats
    information: Floats
    correlation: Floats

    @classmethod
    def of(cls, warped: Floats, target: Floats, inside: Floats, side: int) -> _Patches:
        """Solve every patch for its shift, a gain, a level and its slopes: one step of Lucas and Kanade's.

        The model is ``target = gain (warped + shift . grad warped) + level + slope . x``, linear in gain * shift.
        """
        smooth, wanted = (cv2.GaussianBlur(image, (0, 0), 1.0) for image in (warped, target))
        gx, gy = np.gradient(smooth, axis=1), np.gradient(smooth, axis=0)
        rows, columns = (n // side for n in target.shape)
        ramp = np.linspace(-1.0, 1.0, side)
        slope_y, slope_x = (np.broadcast_to(s.ravel(), (rows * columns, side**2)) for s in np.meshgrid(ramp, ramp))
        t, w, a, b = (_cut(image, rows, columns, side) for image in (smooth, wanted, gx, gy))
        design = np.stack([a, b, t, np.ones_like(t), slope_x, slope_y], axis=-1)
        normal = np.einsum("npi,npj->nij", design, design)
        # A ridge far below any signal keeps blank patches from being singular.
        normal += 1e-6 * np.eye(6) * side**2
        solved = np.linalg.solve(normal, np.einsum("npi,np->ni", design, w)[..., None])[..., 0]
        residual = w - np.einsum("npi,ni->np", design, solved)
        variance = (residual**2).mean(axis=1) + 1e-9
        gain = solved[:, 2]
        gain = np.where(np.abs(gain) > 1e-9, gain, 1e-9)
        # The shift's information once gain, level and slopes are eliminated.
        others = np.linalg.solve(normal[:, 2:, 2:], normal[:, 2:, :2])
        information = (normal[:, :2, :2] - normal[:, :2, 2:] @ others) * (gain**2 / variance)[:, None, None]
        varied = w - w.mean(axis=1, keepdims=True)
        total = (varied**2).mean(axis=1)
        y, x = np.mgrid[0:rows, 0:columns].reshape(2, -1)
        centre = np.stack([x, y], axis=-1) * side + (side - 1) / 2.0
        shift = np.clip(solved[:, :2] / gain[:, None], -STEP_MAX_PX, STEP_MAX_PX)
        # A patch says something if it holds a contrast beyond its noise, and lies wholly in the texture.
        useful = _cut(inside, rows, columns, side).all(axis=1) & (total > 4.0)
        correlation = np.sqrt(np.clip(1.0 - variance / (total + 1e-9), 0.0, 1.0))
        return cls(centre[useful], shift[useful], information[useful], correlation[useful])


def _cut(image: Floats, rows: int, columns: int, side: int) -> Floats:
    """Cut an image into its patches: (rows * columns, side^2)."""
    tiles = image[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return np.ascontiguousarray(tiles.transpose(0, 2, 1, 3).reshape(rows * columns, -1))


def _fitted(patches: _Patches, scale: Floats, offset: Floats, size: tuple[int, int]) -> Registration:
    """Move the map to where the patches want it, the few that disagree hardly counting."""
    n = len(patches.centre)
    if n < N_PATCHES_MIN:
        return Registration(scale, offset, np.inf, np.inf, 0.0, n)
    jacobian = _jacobian(patches.centre, size)
    weight = np.ones(n)
    for _ in range(8):
        A = np.einsum("n,nik,nij,njl->kl", weight, jacobian, patches.information, jacobian)
        c = np.einsum("n,nik,nij,nj->k", weight, jacobian, patches.information, patches.shift)
        change = np.linalg.lstsq(A, c, rcond=None)[0]
        error = patches.shift - jacobian @ change
        size_px = np.linalg.norm(error, axis=1)
        spread = 2.0 * float(np.median(size_px)) + 1e-6
        weight = 1.0 / (1.0 + (size_px / spread) ** 2) ** 2
    squared = np.einsum("n,ni,nij,nj->n", weight, error, patches.information, error)
    trace = weight * np.trace(patches.information, axis1=1, axis2=2)
    residual = float(np.sqrt(2.0 * squared.sum() / trace.sum()))
    inflation = squared.sum() / max(2.0 * weight.sum() - 4.0, 1.0)
    covariance = np.linalg.pinv(A) * max(float(inflation), 1.0)
    corners = _jacobian(np.stack(np.meshgrid(*(np.linspace(0, s - 1, 9) for s in size)), axis=-1).reshape(-1, 2), size)
    expected = float(np.sqrt(np.einsum("nik,kl,nil->n", corners, covariance, corners).mean()))
    # Shift of the warped texture is in scan pixels, about the picture's middle; the map is in the texture's.
    half = (np.array(size) - 1.0) / 2.0
    stretch, shift = change[:2] / half, change[2:]
    factor = float(scale.mean())
    return Registration(
        scale * (1.0 + stretch),
        offset + scale * (shift - stretch * half),
        residual * factor,
        expected * factor,
        float(np.median(patches.correlation)),
        int((weight > 0.25).sum()),
    )


def _jacobian(points: Floats, size: tuple[int, int]) -> Floats:
    """Return the derivative (N, 2, 4) of shifts at points (N, 2) by stretch at the border and shift in the middle."""
    half = (np.array(size) - 1.0) / 2.0
    at = (points - half) / half
    J = np.zeros((len(points), 2, 4))
    J[:, 0, 0], J[:, 1, 1] = at[:, 0], at[:, 1]
    J[:, 0, 2] = J[:, 1, 3] = 1.0
    return J
