"""TOML and JSON: hostile to their parsers, misspelt, of wrong types and out of range."""

from __future__ import annotations

from tests.badinput.case import Case, edited, written

RUN, CALIBRATE = "deskew run page -c c.json -o out/r.png", "deskew calibrate board -o out/c.json"
MAPPED = "deskew flatten unit.obj -o out/f.ply --stiffness materials.png"
VALID = 'version = 1\npattern = "gray_code"\ncamera_size_px = [24, 16]\nprojector_size_px = [8, 7]\nlights = ["uv"]\n'


def toml(what: str, text: str | bytes, *words: str) -> Case:
    """A capture.toml that cannot be used."""
    return Case(what, RUN, ("`page/capture.toml", *words), written("page/capture.toml", text))


def setting(what: str, old: str, new: str, *words: str) -> Case:
    """A capture.toml with one setting changed."""
    return Case(what, RUN, ("`page/capture.toml", *words), edited("page/capture.toml", old, new))


def json(what: str, text: str | bytes, *words: str) -> Case:
    """A calibration.json that cannot be used."""
    return Case(what, RUN, ("`c.json`", *words), written("c.json", text))


def figure(what: str, old: str, new: str, *words: str) -> Case:
    """A calibration.json with one figure changed."""
    return Case(what, RUN, ("`c.json", *words), edited("c.json", old, new))


def board(what: str, old: str, new: str, *words: str) -> Case:
    """A board.toml with one setting changed."""
    return Case(what, CALIBRATE, ("`board/board.toml", *words), edited("board/board.toml", old, new))


def table(what: str, text: str | bytes, *words: str) -> Case:
    """A table of stiffness that cannot be used."""
    return Case(what, MAPPED, ("materials.toml", *words), written("materials.toml", text))


CAPTURES = (
    toml("an empty TOML", "", "have the keys", "none named camera_size_px"),
    toml("a TOML of NUL bytes", bytes(100), "valid TOML"),
    toml("a TOML in UTF-16", VALID.encode("utf-16"), "valid TOML"),
    toml("a TOML in Latin-1", VALID.replace("uv", "\u00fc").encode("latin-1"), "valid TOML"),
    toml("a TOML with a byte order mark", "\ufeff" + VALID, "without a byte order mark"),
    toml("a TOML with a key twice", VALID + "version = 1\n", "valid TOML", "overwrite"),
    toml("a TOML nested 100000 deep", "x = " + "[" * 100_000 + "]" * 100_000, "valid TOML", "nesting too deep"),
    toml("a TOML of tables 500 deep", "".join(f"[{'.'.join('a' * n)}]\n" for n in range(1, 500, 7)), "have the keys"),
    toml(
        "a TOML with an integer of 5000 digits",
        VALID.replace("version = 1", f"version = {'9' * 5000}"),
        "thousands of digits",
    ),
    toml("a TOML of 2 MB", VALID + "#" * (2 << 20), "at most 1048576 bytes"),
    toml("a TOML that is JSON", '{"version": 1}', "valid TOML"),
    toml("a TOML that is YAML", "version: 1\npattern: gray_code\n", "valid TOML"),
    setting("version 2", "version = 1", "version = 2", "version", "be 1", "2"),
    setting("version true", "version = 1", "version = true", "version", "True"),
    setting("version 1.0", "version = 1", "version = 1.0", "version", "1.0"),
    setting("an unknown pattern", "gray_code", "grey_code", "pattern", "gray_code", "'grey_code'"),
    setting("a pattern that is a list", '"gray_code"', '["gray_code"]', "pattern", "be one of"),
    setting("a camera of no width", "[24, 16]", "[0, 16]", "camera_size_px", "[1, 65536]", "[0, 16]"),
    setting("a camera of 10^20 px", "[24, 16]", f"[{10**20}, 16]", "camera_size_px", "[1, 65536]"),
    setting("a camera of one number", "[24, 16]", "24", "camera_size_px", "two integers"),
    setting("a projector of half a pixel", "[8, 7]", "[8.5, 7]", "projector_size_px", "two integers", "8.5"),
    setting("a projector of NaN", "[8, 7]", "[nan, 7]", "projector_size_px", "nan"),
    setting("a size that is a date", "[8, 7]", "1979-05-27", "projector_size_px", "two integers"),
    setting("a misspelt key", "lights", "light", "also 'light'"),
    setting("a missing key", "version = 1\n", "", "none named version"),
    setting("a light that leaves its folder", '"uv"', '"../../c"', "lights", "letters, digits"),
    setting("a light of an absolute path", '"uv"', '"/etc/passwd"', "lights", "letters, digits"),
    setting("a light with a null byte", '"uv"', '"u\\u0000v"', "lights"),
    setting("a light twice", '"uv"', '"uv", "uv"', "lights", "different names"),
    setting("lights that are one word", '["uv"]', '"uv"', "lights", "list of names"),
    setting("300 lights", '"uv"', ", ".join(f'"l{i}"' for i in range(300)), "lights", "at most 256"),
    setting(
        "fringes for a Gray code",
        'lights = ["uv"]\n',
        'lights = ["uv"]\n[fringes]\nperiod_px = [4]\nn_steps = [4]\n',
        "fringes",
        "left out",
    ),
    Case(
        "fringes of no steps",
        "deskew run phase -c c.json -o out/r.png",
        ("`phase/capture.toml", "n_steps", "[4, 256]", "0"),
        edited("phase/capture.toml", "[5]", "[0]"),
    ),
    Case(
        "fringes of an infinite period",
        "deskew run phase -c c.json -o out/r.png",
        ("`phase/capture.toml", "period_px", "inf"),
        edited("phase/capture.toml", "[4.0]", "[inf]"),
    ),
    Case(
        "fringes of two lengths",
        "deskew run phase -c c.json -o out/r.png",
        ("as many n_steps", "1 and 2"),
        edited("phase/capture.toml", "[4.0]", "[8.0, 4.0]"),
    ),
    Case(
        "a capture.toml that is a folder",
        RUN,
        ("`page/capture.toml`", "be a file", "a folder"),
        lambda here: ((here / "page/capture.toml").unlink(), (here / "page/capture.toml").mkdir()),
    ),
)

BOARDS = (
    board("a board of two corners", "[5, 4]", "[2, 4]", "inner_corners", "[3, 1000]"),
    board("a board of a million corners", "[5, 4]", "[1000000, 4]", "inner_corners", "[3, 1000]"),
    board("squares of no size", "25.0", "0.0", "square", "above 0"),
    board("squares of infinite size", "25.0", "inf", "square", "inf"),
    board("squares of 1e300", "25.0", "1e300", "square", "[0.001, 1e+06]"),
    board("squares that are a word", "25.0", '"25"', "square", "finite number", "'25'"),
    board("a unit of markup", '"mm"', '"<b>mm</b>"', "unit", "letters"),
    board("a board without its unit", 'unit = "mm"\n', "", "none named unit"),
)

CALIBRATIONS = (
    json("an empty JSON", "", "valid JSON"),
    json("a JSON of half an object", '{"version": 1', "valid JSON"),
    json("a JSON list", "[]", "hold a JSON object"),
    json("a JSON nested 100000 deep", "[" * 100_000 + "]" * 100_000, "valid JSON", "nesting too deep"),
    json("a JSON object nested 100000 deep", '{"a":' * 100_000 + "1" + "}" * 100_000, "valid JSON", "nesting too deep"),
    json("a JSON with a key twice", '{"version": 1, "version": 1}', "repeated key"),
    json("a JSON with a byte order mark", "\ufeff{}", "without a byte order mark"),
    json("a JSON that is not UTF-8", b'{"unit": "\xff"}', "valid JSON"),
    json("a JSON with an integer of 5000 digits", f'{{"version": {"9" * 5000}}}', "thousands of digits"),
    json("a JSON of 2 MB", " " * (2 << 20) + "{}", "at most 1048576 bytes"),
    figure("a focal length of NaN", "10.0", "NaN", "NaN"),
    figure("a focal length of 1e999", "10.0", "1e999", "K", "finite numbers"),
    figure("a focal length below zero", "10.0", "-10.0", "K", "positive focal lengths"),
    figure("a focal length that is a word", "10.0", '"10"', "K", "3 x 3 finite numbers"),
    figure("a focal length that is true", "10.0", "true", "K", "3 x 3 finite numbers"),
    figure("a rotation that is none", "-1.0", "1.5", "R", "rotation"),
    figure("a calibration of another version", '"version": 1', '"version": 3', "version", "be 1", "3"),
    figure("an unknown key", '"unit"', '"units"', "unit"),
    figure("a residual below zero", "0.1", "-0.1", "camera_rms_px", "at least 0"),
    figure("a spread of nothing", "0.8", "0.0", "camera_psf_px", "above 0"),
    figure("half a board", '"n_poses": 2', '"n_poses": 2.5', "n_poses", "integer"),
    Case(
        "a calibration that is not there",
        "deskew run page -c no.json -o out/r.png",
        ("`no.json`", "be a file", "nothing there"),
    ),
    Case("a calibration that is a folder", "deskew run page -c out -o out/r.png", ("`out`", "be a file", "a folder")),
)

TABLES = (
    table("a stiffness table of another name", "[materials]\n0 = 1.0\n255 = 1.0\n", "[stiffness]", "materials"),
    table("a stiffness of nothing", "[stiffness]\n0 = 0.0\n255 = 1.0\n", "(0, 1e+09]", "0.0"),
    table("a stiffness of NaN", "[stiffness]\n0 = nan\n255 = 1.0\n", "(0, 1e+09]", "nan"),
    table("a stiffness of 1e999", "[stiffness]\n0 = 1e999\n255 = 1.0\n", "(0, 1e+09]", "inf"),
    table("a stiffness that is true", "[stiffness]\n0 = true\n255 = 1.0\n", "True"),
    table("a label without a constant", "[stiffness]\n0 = 1.0\n", "none for 255"),
    table("a label of 65536", "[stiffness]\n65536 = 1.0\n", "label in [0, 65535]"),
    table("a label of 5000 digits", f"[stiffness]\n{'9' * 5000} = 1.0\n", "label in [0, 65535]"),
    table("a label in Arabic digits", '[stiffness]\n"\u0663" = 1.0\n', "label in [0, 65535]"),
    table("a stiffness table that is a list", "stiffness = [1.0]\n", "[stiffness]"),
    Case(
        "a stiffness map without its table",
        MAPPED,
        ("`materials.toml`", "be a file"),
        lambda here: (here / "materials.toml").unlink(),
    ),
)

CASES: tuple[Case, ...] = CAPTURES + BOARDS + CALIBRATIONS + TABLES
