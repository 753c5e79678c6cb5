"""In Jupyter's own kernel: figures are pictures, long work shows a bar, Datasets and motions are short."""

import pytest

nbformat = pytest.importorskip("nbformat", reason="nbclient is not installed: pip install --group dev")
nbclient = pytest.importorskip("nbclient", reason="nbclient is not installed: pip install --group dev")
pytest.importorskip("ipykernel", reason="ipykernel is not installed: pip install --group dev")

CELLS = [
    "import vibrissa as vb\nvb.atlas('C2')",
    "posture, surface = vb.Posture(contact=0.29, base_angle=1.2), vb.random_grating(0.05, rng=1)\n"
    "motion = vb.scan(vb.atlas('C2'), posture, surface, speed=0.1)\n"
    "motion",
    "motion.plot()",
    "print(motion.sample(2000))",
    "profile = vb.track(vb.sample_data('movie.mkv'), frame_rate=2000, pixel_size=95e-6)\nprint(profile)",
]


@pytest.fixture(scope="module")
def outputs():
    book = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS])
    shown = []
    client = nbclient.NotebookClient(book, timeout=300, kernel_name="python3")
    client.on_cell_executed = None
    with client.setup_kernel():
        for k, cell in enumerate(client.nb.cells):
            client.execute_cell(cell, k)
            shown.append(cell.outputs)
    return shown


def test_a_figure_is_a_picture(outputs):
    assert any("image/png" in one.get("data", {}) for one in outputs[2])


def test_reprs_are_short(outputs):
    (motion,) = [one["data"]["text/plain"] for one in outputs[1] if "data" in one]
    assert motion.startswith("<Motion over gaps")
    for cell in outputs[3:5]:
        text = "".join(one["text"] for one in cell if one["output_type"] == "stream" and one["name"] == "stdout")
        assert 5 < len(text.splitlines()) <= 45
        assert max(map(len, text.splitlines())) <= 100


def test_tracking_shows_a_bar_that_is_gone_at_its_end(outputs):
    bars = [one for one in outputs[4] if one["output_type"] == "display_data"]
    assert len(bars) == 1
    assert bars[0]["data"]["text/html"] == ""
