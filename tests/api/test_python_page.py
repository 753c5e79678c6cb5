"""The page on Python runs as it is printed: ten lines with one import first."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "python.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


@pytest.fixture(scope="module")
def names():
    return {}


def test_the_whole_chain_is_ten_lines_with_one_import():
    first = [line for line in BLOCKS[0].splitlines() if line]
    assert len(first) == 10
    assert [line for line in first if "import" in line] == ["import vibrissa as vb"]


@pytest.mark.parametrize("block", BLOCKS, ids=[block.partition("\n")[0] for block in BLOCKS])
def test_every_block_runs_as_printed(block, names):
    exec(compile(block, "python.md", "exec"), names)
    if "envelope_coupling" in block:
        assert bool(names["units"].significant.any())
        assert names["units"].sizes["unit"] == 20
