"""Which pictures of a page are asked for: lights, combinations of them, their size and their files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from deskew.cli.options import EVERY_LIGHT
from deskew.errors import require

if TYPE_CHECKING:
    from deskew.types import Array

PICTURES = (".png", ".tif", ".tiff")


@dataclass(frozen=True, slots=True)
class Wanted:
    """Which pictures of a page are asked for, and where; plain white if neither lights nor combinations are named."""

    output: Path
    lights: tuple[str, ...]
    combine: tuple[str, ...]
    scale: float

    @classmethod
    def of(cls, output: Path, lights: Sequence[str] | None, combine: Sequence[str] | None, scale: float) -> Wanted:
        """Take the options of a command; each light and combination counts once."""
        require(math.isfinite(scale) and 0 < scale <= 16, "--scale", "lie in (0, 16]", scale)
        return cls(output, tuple(dict.fromkeys(lights or ())), tuple(dict.fromkeys(combine or ())), scale)

    def named(self, known: Sequence[str]) -> tuple[str, ...]:
        """Lights that the command line names; `all` are all that there are."""
        every = known if EVERY_LIGHT in self.lights else ()
        return tuple(dict.fromkeys([*every, *(light for light in self.lights if light != EVERY_LIGHT)]))

    def shown(self, known: Sequence[str]) -> tuple[str, ...]:
        """Lights that are a picture of their own."""
        from deskew.types import WHITE

        return self.named(known) or (() if self.combine else (WHITE,))

    def combined(self, how: str, known: Sequence[str]) -> list[str]:
        """Return the lights that a combination is made of: a ratio's two, else those that are named, else all."""
        from deskew import restoration

        return restoration.lights_of(how, self.named(known) or known)

    def needed(self, known: Sequence[str]) -> list[str]:
        """Return the lights to restore, each once."""
        combined = [light for how in self.combine for light in self.combined(how, known)]
        return list(dict.fromkeys([*self.shown(known), *combined]))

    def paths(self, known: Sequence[str]) -> dict[str, Path]:
        """Name one picture as asked, several after what each shows."""
        from deskew import restoration

        names = [*self.shown(known)]
        for how in self.combine:
            names += restoration.pictures_of(how, self.combined(how, known))
        twice = sorted({name for name in names if names.count(name) > 1})
        require(not twice, "--combine", "give pictures of different names", f"several called {', '.join(twice)}")
        if len(names) == 1:
            return {names[0]: self.output}
        return {name: self.output.with_name(f"{self.output.stem}-{name}{self.output.suffix}") for name in names}

    def check(self, known: Sequence[str]) -> None:
        """Refuse what these lights cannot give, and where it cannot be written, before any long work."""
        from deskew import io, restoration

        named = self.named(known)
        for light in named:
            require(light in known, "--light", f"be one of {', '.join(known)}", light)
        for how in self.combine:
            ratio = how.startswith("ratio:")
            restoration.require_combination(how, known if ratio else named or known)
        for path in self.paths(known).values():
            io.require_writable(path, PICTURES)


def write_pictures(
    pictures: Mapping[str, Array],
    paths: Mapping[str, Path],
    profiles: Mapping[str, bytes],
    dpi: tuple[float, float] | None = None,
) -> None:
    """Write every picture or leave none behind, each with its light's colour profile."""
    from deskew import io

    with all_or_none(paths.values()):
        for name, path in paths.items():
            image, profile = pictures[name], profiles.get(name)
            # A method of one's own may make a grey picture of a coloured page: the page's profile is not its.
            fits = profile is not None and io.is_profile(profile, 1 if image.ndim == 2 else 3)
            io.write_image(image, path, profile=profile if fits else None, dpi=dpi)


@contextmanager
def all_or_none(paths: Iterable[Path]) -> Iterator[None]:
    """Leave none of the files behind if writing one of them fails."""
    try:
        yield
    except BaseException:
        for path in paths:
            path.unlink(missing_ok=True)
        raise
