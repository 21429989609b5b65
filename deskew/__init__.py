"""Restore an arbitrarily warped page from its 3D shape (Brown and Seales, ICCV 2001).

`deskew.pipeline` chains the stages: `acquisition` (section 2), `flattening` (section 3), `restoration` (section 3.5);
`deskew.metrics` measures the result, `deskew.io` reads and writes, `deskew.types` is what passes between them.
"""
