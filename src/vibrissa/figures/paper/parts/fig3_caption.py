"""What the caption of Figure 3 says: what is measured, what follows from it, what was set beforehand."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from vibrissa.figures.paper.parts.fig3_panels import PAPER_MEAN, PAPER_SD
from vibrissa.figures.words import with_error

SHADOW = 3e-3  # [m] of shaft before the contact that the paper's light does not show


def caption(facts: Mapping[str, Any]) -> str:
    """Say what of A to E there is.

    Parameters
    ----------
    facts : mapping
        Attributes of the figure.

    Returns
    -------
    str
        The caption.
    """
    parts = [_sources(facts)]
    if "base_height" in facts:
        scale = f"A, the set-up, to scale but for the depth of the grating, {1e6 * facts['depth']:.0f} µm; pale: its"
        parts.append(f"{scale} gaps; blue: the field of the camera, which looks along their edges.")
    else:
        parts.append("A, the set-up: not given.")
    parts.append(_of_frame(facts))
    if "exaggeration" in facts:
        parts.append(_of_motion(facts))
    parts.append(_of_runs(facts) if "runs" in facts else "D and E, repeated runs: not measured.")
    if "exaggeration" in facts:
        parts.append(_of_shares(facts))
    return " ".join(parts)


def _sources(facts: Mapping[str, Any]) -> str:
    """What moved in each panel."""
    if "runs" not in facts:
        return f"Figure 3. {facts['of_movie'].capitalize()}."
    less = ", which move less since their free end bridges the gaps" if facts["of_runs"].endswith("rods") else ""
    return f"Figure 3. A–C, F, G: {facts['of_movie']}; D, E: {facts['of_runs']}{less}."


def _of_frame(facts: Mapping[str, Any]) -> str:
    names = json.loads(facts["names"])
    those = (
        f"whisker{'s' * (len(names) > 1)} {', '.join(names)}" if len(names) > 1 else "the only whisker of this movie"
    )
    free = "; pale: the free end, which lies on the substrate" if "base_height" in facts else ""
    return f"B, one frame; dotted: the centreline found of {those}; rectangle: the region of C{free}."


def _of_motion(facts: Mapping[str, Any]) -> str:
    """C: the field of motion, and one node."""
    scale = f"{facts['exaggeration']:g} times too large" if facts["exaggeration"] > 1 else "to scale"
    return (
        f"C, left: displacements about the mean profile in successive frames, drawn {scale}, and the paths of nodes; "
        f"right: x and y of the node that moves most. The tracker measures {facts['measured']} alone."
    )


def _of_shares(facts: Mapping[str, Any]) -> str:
    """F and G: not the paper's."""
    if "share_across" not in facts:
        return (
            "Not in the paper: F, motion along the shaft would follow from that across it, but no skin point is known, "
            "where it starts. G, motion of some nodes."
        )
    known = [name for name in facts if name.startswith("share_across")]
    percent = {name: f"{100 * facts[name]:.1f}\N{NO-BREAK SPACE}%" for name in known}
    true = f"; truth {percent['share_across_true']}" if "share_across_true" in facts else ""
    lit = (
        f" Without the last {1e3 * SHADOW:g} mm before the contact, which the paper's light does not show, it is "
        f"{percent['share_across_lit']}."
        if "share_across_lit" in facts
        else ""
    )
    return (
        "Not in the paper: F, the tracker measures motion u across the mean profile; motion w along it is computed, as "
        "the shaft does not stretch: dw = u dφ, with φ the direction of the profile. "
        f"Over the {1e3 * facts['shaft_shown']:.1f} mm shown, {percent['share_across']} of the power is across "
        f"({percent['share_across_tracked']} with the noise of the nodes{true}).{lit} G, motion of some nodes."
    )


def _of_runs(facts: Mapping[str, Any]) -> str:
    """D and E: the correlations, and what they would be without the run itself in the mean."""
    n = facts["runs"]
    alike = (5 * PAPER_MEAN**2 - 1) / 4
    others = alike / np.sqrt((1 + 3 * alike) / 4)
    found = {
        name: f"{with_error(facts[f'{name}_mean'], facts[f'{name}_sd'])}"
        for name in ("run_correlation", "run_correlation_others", "run_correlation_true")
        if f"{name}_mean" in facts
    }
    true = f" ({found['run_correlation_true']} without noise)" if "run_correlation_true" in found else ""
    return (
        f"D, y of one node in {n} runs over one texture (below; pale: gaps), their mean in black; left: the "
        f"correlation of a run with that mean{_chosen(facts)}. E, these correlations of all {facts['repetitions']} × "
        f"{n} runs, side by side by experiment; squares: medians. {_jitter(facts)}Mean ± SD: with the mean of all runs "
        f"{found['run_correlation']}{true}, which holds the run itself, so that runs with nothing in common reach "
        f"{1 / np.sqrt(n):.2f}; with the mean of the others {found['run_correlation_others']}. "
        f"The paper's {PAPER_MEAN} would be {others:.2f} with the others, and {alike:.2f} between two runs."
    )


def _chosen(facts: Mapping[str, Any]) -> str:
    """How D was chosen."""
    number = facts["repetitions"]
    return f"; of the {number} experiments, the one whose runs are most alike" if number > 1 else ""


def _jitter(facts: Mapping[str, Any]) -> str:
    if "jitter_clock" not in facts:
        return ""
    return (
        f"Virtual movies of one texture. From run to run differ: the start, evenly within "
        f"±{facts['jitter_clock']:g} frame; the speed, by a ripple of {100 * facts['jitter_ripple']:g} % at "
        f"{facts['jitter_ripple_frequency']:g} Hz of random phase; the contact ε, by {facts['jitter_contact']:g} (SD); "
        f"the noise. The paper gives none of these: they were set beforehand, not fitted to its "
        f"{PAPER_MEAN} ± {PAPER_SD}, and leave out heart and breath. "
    )
