"""The notebooks of the pages run from their first cell to their last, and say nothing on stderr but remarks."""

from pathlib import Path

import pytest

reader = pytest.importorskip("myst_nb.core.read", reason="myst-nb is not installed: pip install --group docs")
nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: pip install --group dev")
pytest.importorskip("ipykernel", reason="ipykernel is not installed: pip install --group dev")
pytest.importorskip("nitime", reason="nitime, whose recording is read, is not installed: pip install --group dev")

LEARN = Path(__file__).parents[2] / "docs" / "learn"


@pytest.mark.parametrize("path", sorted(LEARN.glob("*.md")), ids=lambda path: path.stem)
def test_a_notebook_runs_and_shows_pictures(path, tmp_path):
    book = reader.read_myst_markdown_notebook(path.read_text(encoding="utf-8"))
    nbclient.NotebookClient(book, timeout=120, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [one for cell in book.cells if cell.cell_type == "code" for one in cell.outputs]
    assert any("image/png" in one.get("data", {}) for one in shown)
    for one in shown:
        if one.get("name") == "stderr":
            assert "Remark: " in one["text"], one["text"]
    assert not list(tmp_path.iterdir())  # nothing is left behind where the reader works
