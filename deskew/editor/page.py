"""The editor's page, a marimo notebook that `deskew edit` serves: it lays out, and does nothing else."""

# mypy: disable-error-code="no-untyped-def"

import marimo

__generated_with = "0.25.2"
app = marimo.App(width="full", app_title="deskew: stiffness")


@app.cell
def _():
    import marimo as mo

    from deskew.editor.serving import served_desk
    from deskew.editor.widget import Bench

    return Bench, mo, served_desk


@app.cell
def _(Bench, mo, served_desk):
    mo.ui.anywidget(Bench(served_desk()))
    return


if __name__ == "__main__":
    app.run()
