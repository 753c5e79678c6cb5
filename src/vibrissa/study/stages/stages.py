"""The table of the work of a study: ``STAGES``, in the order in which a run does them.

A new stage is one entry here and one file with its function, a new figure one entry and one file with its ``compute``
and ``draw``: the run, the plan (``--dry-run``), the provenance, the report and ``vibrissa figure`` read this table.
"""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType
from typing import TYPE_CHECKING, Any

from vibrissa.figures.others import base_signal as base_figure
from vibrissa.figures.others import recovery
from vibrissa.figures.others import scan as scan_figure
from vibrissa.figures.paper import (
    fig1,
    fig2,
    fig3,
    fig4,
    fig5,
    fig6,
    fig6_envelopes,
    fig6_model,
    fig7,
    fig7e,
    fig8,
    fig9,
)
from vibrissa.mechanics.across.comparison import compare_sweeps
from vibrissa.mechanics.across.gain import gain_table
from vibrissa.mechanics.inverse.decomposition import decompose
from vibrissa.mechanics.inverse.resonance import fit_modes
from vibrissa.neural.coupling.analysis import analyse_units
from vibrissa.neural.coupling.response import spike_counts
from vibrissa.neural.io.recording import recorded_spikes
from vibrissa.quantities.kinds import Results, Series
from vibrissa.study.forward.base_signals import analyse_signal, base_signals
from vibrissa.study.forward.model_figures import model_figures
from vibrissa.study.forward.surface import scan_surface, study_surface
from vibrissa.study.movie import one_movie
from vibrissa.study.movie.apparatus import apparatus, true_profile
from vibrissa.study.movie.backward import still_of
from vibrissa.study.movie.resting import at_rest, posture_at_rest
from vibrissa.study.movie.track_file import track_file
from vibrissa.study.movie.verdict import hold_against
from vibrissa.study.movie.virtual import exposed_signals, film_motion, record_unit
from vibrissa.study.neurons import cortex
from vibrissa.study.neurons.populations import (
    ends_of_recordings,
    prepare_stimulator,
    recorded_results,
    simulated_results,
)
from vibrissa.study.neurons.shown_unit import EXAMPLES, shown_unit, unit_examples
from vibrissa.study.neurons.stimuli import read_stimulus
from vibrissa.study.paper.mode_shares import mode_shares
from vibrissa.study.paper.paper_columns import MODELLED, OWNED
from vibrissa.study.spec.parts import every_by_modes, has_rod, table_of
from vibrissa.study.spec.settings import Study
from vibrissa.study.stages import costs
from vibrissa.study.stages.stage import FigureEntry, Output, Stage
from vibrissa.study.sweeps import sweep_pipeline
from vibrissa.study.sweeps.phase_jitter import jittered
from vibrissa.study.sweeps.recorded_sweeps import known_sweep
from vibrissa.study.sweeps.repeats import film_repeats, true_repeats
from vibrissa.study.sweeps.sweep_table import sweep_table
from vibrissa.study.sweeps.sweep_verdict import sweep_verdict
from vibrissa.study.sweeps.virtual_sweep import filmed_sweep
from vibrissa.video.tracking import track
from vibrissa.whisker import Whisker

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

    Make = Callable[[Results, Series], Figure]


def _has(*parts: str) -> Callable[[Study], bool]:
    """Whether a study has one of these parts."""
    return lambda study: any(bool(getattr(study, part)) for part in parts)


def _all(*tests: Callable[[Study], bool]) -> Callable[[Study], bool]:
    return lambda study: all(test(study) for test in tests)


_movie, _film, _virtual, _sweeps = _has("movie", "film"), _has("film"), _has("laboratory"), _has("laboratory", "sweeps")
_surface, _fitted = _has("only_surface"), _all(_movie, _has("whisker"), _has("posture"))


def _compared(study: Study) -> bool:
    """Whether a prediction can be compared with the sweeps: a texture is known."""
    return _virtual(study) or any(one.texture is not None for one in table_of(study))


def _by_modes(study: Study) -> bool:
    """Whether some of its sweeps are also made with the paper's model as the truth."""
    return every_by_modes(study) > 0


def _filmed(study: Study) -> bool:
    return _virtual(study) or any(one.movie is not None for one in table_of(study))


def _film_fitted(study: Study) -> bool:
    """Whether a virtual movie comes to everything that is shown of one sweep."""
    return _film(study) and _fitted(study)


def _ends_of_signals(study: Study) -> list[str]:
    return [f"_{number}" for number in range(1, len(study.base_signal) + 1)]


def _computed(module: ModuleType) -> Make:
    """Figure of all results."""
    return lambda results, _: module.draw(module.compute(results))


def _with_series(module: ModuleType) -> Make:
    """Figure of all results and the time series of the sweeps."""
    return lambda results, series: module.draw(module.compute(results, series))


def _of_one(module: ModuleType, name: str) -> Make:
    """Figure of one result."""
    return lambda results, _: module.draw(module.compute(results[name]))


def _drawn(module: ModuleType, name: str) -> Make:
    """Figure of a result that is computed for it."""
    return lambda results, _: module.draw(results[name])


def _first(results: Results, series: Series) -> Figure:
    attrs = results["posture"].attrs
    whisker = Whisker(length=attrs["whisker_length"], cone_angle=attrs["cone_angle"], tip=attrs["tip"])
    profile, still = at_rest(results["profile"].isel(whisker=0), results["posture"]), results.get("still")
    known: dict[str, Any] = {"still": still, "contact_true": attrs["contact_true"], "sweeps": results.get("sweeps")}
    known["series"] = series
    return fig1.draw(fig1.compute(profile, results["posture"], whisker, **known))


def _ninth(results: Results, _: Series) -> Figure:
    units = results["units"]  # of simulated ones the truth is drawn beside what was found
    return fig9.draw(fig9.compute(units, truth=units if "driven_by" in units else None))


_NO_NEURONS = "no [recording], no [cortex] and no [[neural]]"
_MODEL = "made of [laboratory], sweeps or a surface alone"

_SWEPT = ("sweeps", "mode_shares")  # of sweeps of which any was accepted

STAGES = (
    Stage("base signals", _has("base_signal"), base_signals,
          (Output("base_signal", analyse_signal, ("inputs", "study"), ends=_ends_of_signals,
                  absent="no [[base_signal]]"),),
          cost=costs.base_signals,
          figures=(FigureEntry("base", "Base signal", ("base_signal",), _of_one(base_figure, "base_signal"),
                               each="Base signal: {label}", optional=True),)),
    Stage("scan of the surface", _surface, study_surface,
          (Output("scan", scan_surface, ("study", "inputs"), absent="no [texture] without a movie"),),
          part="texture", cost=costs.surface,
          figures=(FigureEntry("surface", "From the surface to the follicle (model)", ("scan",),
                               _of_one(scan_figure, "scan"), optional=True),)),
    Stage("sweeps", _sweeps, sweep_pipeline.run_sweeps,
          (Output("sweeps", sweep_table, ("sweeps/",), absent="no [laboratory] and no sweeps"),
           Output(f"sweeps{MODELLED}", sweep_table, ("sweeps/",), when=_by_modes),
           Output("mode_shares", mode_shares, ("sweeps",)),
           Output("sweep_verdict", sweep_verdict, ("sweeps",), when=_virtual)),
          part="sweeps", cost=costs.sweeps,
          figures=(FigureEntry("10", "Figure 10: resonance and damping of every sweep", ("sweeps",),
                               _computed(recovery), optional=True),)),
    Stage("comparison", _all(_sweeps, _compared), sweep_pipeline.compare_with_prediction,
          (Output("comparison", compare_sweeps, ("comparison/",),
                  absent="no texture of a sweep is known: nothing to compare with the measurement"),
           Output(f"comparison{OWNED}", compare_sweeps, ("comparison/",), when=has_rod),
           Output(f"comparison{MODELLED}", compare_sweeps, ("comparison/",), when=_by_modes)),
          inputs=_SWEPT, part="comparison", after=("sweeps",), follows=True, cost=costs.comparison,
          figures=(FigureEntry("6", "Figure 6C–D: envelopes predicted and measured", ("sweeps", "comparison"),
                               _with_series(fig6_envelopes)),)),
    Stage("gain", _sweeps, sweep_pipeline.find_gain,
          (Output("gain", gain_table, ("sweeps",), absent="no sweep was analysed to the end"),),
          inputs=_SWEPT, part="gain", after=("sweeps",), follows=True,
          figures=(FigureEntry("7", "Figure 7A–D: what sets the gain", ("sweeps", "gain"), _with_series(fig7),
                               optional=True),)),
    Stage("repeated runs", lambda study: _virtual(study) and study.comparison.repeats > 0,
          sweep_pipeline.repeat_sweeps,
          (Output("repeats", film_repeats),
           Output(f"repeats{OWNED}", true_repeats, ("repeats",), when=has_rod),
           Output(f"repeats{MODELLED}", film_repeats, when=_by_modes)),
          inputs=_SWEPT, part="repeats", after=("sweeps",), follows=True, cost=costs.repeats),
    Stage("jitter", lambda study: _sweeps(study) and study.comparison.jitter > 0 and _compared(study),
          sweep_pipeline.disturb_tip, (Output("jitter", jittered, ("sweeps",)),),
          inputs=_SWEPT, part="jitter", after=("sweeps",), follows=True, cost=costs.jitter),
    Stage("one sweep shown", lambda study: _sweeps(study) and not _film_fitted(study), sweep_pipeline.show_sweep,
          (Output("profile", filmed_sweep, ("study", "sweeps"), when=_virtual),
           Output("profile", known_sweep, ("inputs", "sweeps")),
           Output("still", filmed_sweep, ("study", "sweeps"), when=_virtual),
           Output("still", still_of, ("inputs",), when=_filmed),
           Output("apparatus", apparatus, when=_virtual),
           Output("posture", posture_at_rest, ("profile", "study")),
           Output("modal", decompose, ("profile", "sweeps")),
           Output("resonance_white", fit_modes, ("modal",)),
           Output("spectra_white", fit_modes, ("modal",))),
          inputs=_SWEPT, part="one sweep shown", after=("sweeps",), follows=True, cost=costs.sweep_shown),
    Stage("figures of the model", _has("only_surface", "laboratory", "sweeps"), model_figures,
          (Output("gap", fig2.compute, ("study", "sweeps"), absent=f"{_MODEL}, where the posture can cross the gap"),
           Output("gaps", fig6_model.compute, ("study", "sweeps"),
                  absent=f"{_MODEL}, where the posture can cross the gaps"),
           Output("gain_map", fig7e.compute, ("study", "sweeps"), absent=_MODEL)),
          part="figures of the model", after=("texture", "sweeps"), follows=True, cost=costs.model_figures,
          figures=(FigureEntry("2", "Figure 2: one gap crossed (model)", ("gap",), _drawn(fig2, "gap"), optional=True),
                   FigureEntry("6ab", "Figure 6A–B: gaps of several widths (model)", ("gaps",),
                               _drawn(fig6_model, "gaps"), optional=True),
                   FigureEntry("7e", "Figure 7E: gain over posture (model)", ("gain_map",),
                               _drawn(fig7e, "gain_map"), optional=True))),
    Stage("predicting", _film, one_movie.predict_film,
          (Output("prediction", exposed_signals, absent="no texture is known"),), part="movie", cost=costs.predicting,
          figures=(FigureEntry("6", "Figure 6: envelopes of one sweep", ("modal", "prediction"), _computed(fig6)),)),
    Stage("filming", _film, one_movie.film_file, (Output(one_movie.MOVIE, film_motion),),
          part="movie", cost=costs.filming),
    Stage("tracking", _movie, one_movie.track_movie,
          (Output("profile", track, (one_movie.MOVIE,), when=_film, absent="no movie and no tracks"),
           Output("profile", track_file, ("inputs",)),
           Output("still", still_of, (one_movie.MOVIE,), when=_film,
                  absent="the sweep shown was given as tracks, without a movie"),
           Output("still", still_of, ("inputs",)),
           Output("apparatus", apparatus, when=_film),
           Output("true_profile", true_profile, when=_film)),
          part="movie", cost=costs.tracking,
          figures=(FigureEntry("3", "Figure 3: tracking", ("still", "profile"), _computed(fig3)),)),
    Stage("posture", _all(_movie, _has("whisker")), one_movie.fit_posture,
          (Output("posture", posture_at_rest, ("profile", "study"),
                  absent="no whisker was given, or Eq. 1 could not be laid on its mean profile"),),
          inputs=("profile",), part="movie",
          figures=(FigureEntry("1", "Figure 1: whisker and profile at rest", ("profile", "posture"), _first),)),
    Stage("decomposing and fitting", _fitted, one_movie.fit_movie,
          (Output("modal", decompose, ("profile",), absent="no whisker, no posture, or frames were lost"),
           Output("resonance_white", fit_modes, ("modal",), absent="no modes"),
           Output("spectra_white", fit_modes, ("modal",), absent="no modes"),
           *(Output(name, fit_modes, ("modal", "prediction"), when=_film) for name in ("resonance", "spectra")),
           *(Output(f"{name}_true", fit_modes, ("prediction",), when=_film) for name in ("resonance", "spectra"))),
          inputs=("profile",), part="movie", cost=costs.fitting,
          figures=(FigureEntry("4", "Figure 4: decomposition", ("modal",), _computed(fig4)),
                   FigureEntry("5", "Figure 5: spectra", ("spectra_white", "resonance_white"), _with_series(fig5)))),
    Stage("recording one unit", _all(_fitted, _has("recording")), one_movie.record_neuron,
          (Output("spikes", record_unit, ("study", "prediction"), absent=_NO_NEURONS),
           Output("response", spike_counts, ("spikes", "modal", "prediction"), absent=_NO_NEURONS)),
          inputs=("modal",), part="movie",
          figures=(FigureEntry("8", "Figure 8: one neuron", ("spikes", "response"), _computed(fig8),
                               each="Figure 8: one unit of {label}"),)),
    Stage("verdict", _all(_film, _fitted), one_movie.judge,
          (Output("verdict", hold_against, ("resonance", "modal", "prediction", "response")),),
          inputs=("resonance",), part="movie"),
    Stage("stimulator", _has("cortex"), prepare_stimulator, (),  # needs no sweeps, but fills gaps after the long tasks
          part="cortex", after=("sweeps",), cost=costs.stimulator),
    Stage("simulated units", _has("cortex"), simulated_results,
          (Output("units", analyse_units,
                  absent="no table of units: no [cortex] and no [[neural]], or see the verb neural"),
           Output(EXAMPLES, unit_examples, ("units", "study")),
           *(Output(name, made_by, made_from, when=lambda study: study.recording is None)
             for name, made_by, made_from in (
                 ("spikes", cortex.recorded, ("study",)), ("response", shown_unit, ("spikes", "study")),
                 ("motion", cortex.motion_of, ("study",)), ("unit", shown_unit, ("units", "spikes"))))),
          part="cortex", cost=costs.simulated_units,
          figures=(FigureEntry("9", "Figure 9: the population", ("units",), _ninth, each="Figure 9: {label}",
                               optional=True),)),
    Stage("recorded neurons", _has("neural"), recorded_results,
          tuple(Output(name, made_by, made_from, ends=ends_of_recordings) for name, made_by, made_from in (
              ("units", analyse_units, ("inputs", "study")), ("spikes", recorded_spikes, ("inputs",)),
              ("response", shown_unit, ("spikes", "inputs")), ("motion", read_stimulus, ("inputs",)),
              (EXAMPLES, unit_examples, ("units", "inputs")), ("unit", shown_unit, ("units", "spikes")))),
          cost=costs.recorded_neurons),
)  # fmt: skip


def outputs_of(study: Study) -> Iterator[tuple[str, Output]]:
    """Names of the results of a study in the order in which they are made, each with its output; the last one counts.

    Parameters
    ----------
    study : Study
        Any.

    Yields
    ------
    str, Output
        Name, and what makes it.
    """
    for stage in STAGES:
        if stage.asked(study):
            made = [(output.name + end, output) for output in stage.outputs if output.when(study)
                    for end in output.ends(study)]  # fmt: skip
            yield from dict(reversed(made)).items()  # of two of one name the first


def expected(study: Study) -> set[str]:
    """Names of the datasets that a study comes to, if nothing in it fails.

    Parameters
    ----------
    study : Study
        Any.

    Returns
    -------
    set of str
        ``unit`` is not among them: it is there only if a unit is driven.
    """
    return {name for name, output in outputs_of(study) if "." not in name and output.name != "unit"}
