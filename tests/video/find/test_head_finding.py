"""The head of rendered scenes, whose motion is known."""

import numpy as np
from moved_heads import head_error, scene
from refusals import refusal

from vibrissa.video.camera.pad.filming import film
from vibrissa.video.find.head_finding import find_head


def test_the_head_is_found_where_it_is():
    """The outline's points are good to about half a pixel by hairs; hundreds of them fix the head to a part of that."""
    one = scene(1)
    known, place, turn = head_error(find_head(film(one, 24)), one, 24)
    assert known == 24
    assert place < 0.5
    assert turn < 0.5


def test_a_movie_without_a_body_is_refused():
    with refusal("too-few", "head"):
        find_head([np.full((3, 80, 80), 150, np.uint8)])
