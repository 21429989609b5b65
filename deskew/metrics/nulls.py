"""Null controls: the truth itself, spoilt by a stated amount, and what a metric must read on it.

A metric that does not see the shift, or reads a shuffled text as half right, measures nothing; one that reads more of
a restored page than of a page moved by one pixel says how much of the figure is placement.

=============================  =====================================  ==========================================
metric                         truth moved by (dx, dy) pixels         truth with its letters shuffled
=============================  =====================================  ==========================================
`ms_ssim_docunet`, `..._wang`  below 1, falling as the shift grows
`ld_dis_px`                    the shift, in pixels of the flow
`ad_dis`, `lid_dis_px`         about 0: a shift is aligned away
`line_straightness_px`         as before: a shift bends no line
`misses`                                                              most of the letters, their number unchanged
=============================  =====================================  ==========================================
"""

from __future__ import annotations

import numpy as np

from deskew.errors import require
from deskew.types import Array


def shifted(image: Array, dx: int, dy: int = 0) -> Array:
    """Move a picture by whole pixels, right and down; its border is repeated where nothing comes after it.

    Parameters
    ----------
    image : (height, width[, 3]) array
        The truth.
    dx, dy : int
        Fewer than the picture has [px].

    Returns
    -------
    array like `image`
    """
    height, width = image.shape[:2]
    require(abs(dx) < width and abs(dy) < height, "dx, dy", f"move less than {width}x{height} px", (dx, dy))
    rows = np.clip(np.arange(height) - dy, 0, height - 1)
    columns = np.clip(np.arange(width) - dx, 0, width - 1)
    return image[rows[:, None], columns]


def shuffled(text: str, rng: np.random.Generator) -> str:
    """Put a text's letters into random order; white space stays where it is.

    Parameters
    ----------
    text : str
        The truth.
    rng : numpy.random.Generator
        Draws the order.

    Returns
    -------
    str
        As long, of the same letters.
    """
    letters = iter(rng.permutation([letter for letter in text if not letter.isspace()]))
    return "".join(letter if letter.isspace() else str(next(letters)) for letter in text)
