"""What holds when speed and posture change: by decoders' own blindness, and in the model."""

import io

import numpy as np
import pytest
from refusals import refusal

from vibrissa.figures.others import robustness
from vibrissa.figures.others import robustness_chain as chain
from vibrissa.figures.others.robustness_chain import CLAIM, DECODERS
from vibrissa.mechanics.statics.profile import Posture
from vibrissa.whisker import Whisker

WHISKER = Whisker(length=0.055, cone_angle=1.2e-3, tip=0.05)
POSTURE = Posture(contact=0.29, base_angle=1.2)


@pytest.fixture(scope="module")
def data():
    ways = robustness.ways(POSTURE, 0.1, speeds=(0.5, 2.0), heights=(0.9,), angles=(0.75,))
    rng = np.random.default_rng(1)
    return robustness.compute(WHISKER, ways, rng=rng, n_sets=3, n_trials=12, mean_periods=(0.6e-3,) * 4)


# Decoders on counts made by hand: what each must and must not notice

_EACH = list(DECODERS.values())


class Still:
    """A code that nothing drives."""

    def drive(self, _moved, _rate, n_bins):
        return np.zeros((2, n_bins))


rng = np.random.default_rng(2)
TAUGHT = {
    (code, bins): 6 * rng.gamma(1.0, 1.0, (4, 5, 30)) * rng.uniform(0.5, 2.0, (4, 5, 1))
    for code in ("envelope", "spectrum", "events")
    for bins in ("distance", "time")
}


def asked(change):
    shares = chain.accuracies(TAUGHT, {key: change(one) for key, one in TAUGHT.items()}, 1.0, 40, rng=rng)
    return dict(zip(DECODERS, shares, strict=True))


def test_decoders_of_any_gain_do_not_mind_it_and_those_of_the_rate_do():
    same, weaker = asked(lambda one: one), asked(lambda one: 0.4 * one)
    for name, decoder in DECODERS.items():
        assert same[name] > 0.9
        if decoder.pattern:
            assert weaker[name] > 0.9
    assert weaker["mean rate"] < 0.6


def test_decoders_of_totals_do_not_mind_the_order_and_patterns_do():
    orders = [rng.permutation(30) for _ in range(6)]
    answers = [asked(lambda one, order=order: one[..., order]) for order in orders]
    mixed = {name: np.mean([answer[name] for answer in answers]) for name in DECODERS}
    for name, decoder in DECODERS.items():
        if decoder.read is chain.all_bins:
            assert not decoder.pattern or mixed[name] < 0.5
        else:
            assert mixed[name] > 0.9


def test_a_reader_that_knows_the_speed_reckons_with_how_long_it_lasts():
    slow = chain.accuracies(TAUGHT, {key: 2 * one for key, one in TAUGHT.items()}, 2.0, 40, rng=rng)
    assert dict(zip(DECODERS, slow, strict=True))["mean rate"] > 0.95


def test_trials_are_drawn_in_the_order_of_the_decoders_whatever_strings_hash_to():
    people = {decoder.code: chain.Population(code=Still(), baseline=np.ones(2), gain=np.ones(2)) for decoder in _EACH}
    found = chain.expected_everywhere(people, np.zeros((3, 40)), robustness.LENGTH, 0.1, 0.1)
    in_order = [(decoder.code, decoder.bins) for decoder in _EACH]
    assert list(found) == sorted(set(in_order), key=in_order.index)


def test_textures_that_are_alike_are_not_told_apart():
    alike = {key: np.repeat(one[:1], 4, axis=0) for key, one in TAUGHT.items()}
    shares = [chain.accuracies(alike, alike, 1.0, 40, rng=rng) for _ in range(10)]
    np.testing.assert_allclose(np.mean(shares, axis=0), 0.25, atol=0.04)


# Numbers over sets


def test_share_kept_worked_by_hand():
    found = np.array([[0.8, 0.9, 1.0], [0.5, 0.55, 0.6], [0.6, 0.65, 0.7]])
    share, low, high = robustness.kept_share(found, np.array([False, True, True]), 0.2)
    assert share == pytest.approx((0.6 - 0.2) / (0.9 - 0.2))
    assert low < share < high
    nothing = robustness.kept_share(np.array([[0.2, 0.3, 0.1]] * 2), np.array([False, True]), 0.2)
    assert np.all(np.isnan(nothing))


def test_interval_of_the_share_kept_holds_it_as_often_as_it_says():
    rng, of_arm, held = np.random.default_rng(4), np.array([False, True, True]), 0
    for _ in range(200):
        of_set = rng.normal(0, 0.05, 16)  # sets that are easy are so in every way
        found = np.array([0.9, 0.6, 0.7])[:, None] + of_set + rng.normal(0, 0.04, (3, 16))
        _, low, high = robustness.kept_share(found, of_arm, 0.2)
        held += low <= (0.65 - 0.2) / (0.9 - 0.2) <= high
    assert 181 <= held <= 199  # 95 % of 200, give or take three standard deviations


# The chain from textures to answers


def test_populations_of_all_codes_fire_alike_often():
    textures = [robustness.random_grating(robustness.LENGTH, rng=np.random.default_rng(k)) for k in range(4)]
    (taught, *_) = robustness.ways(POSTURE, 0.1)
    moved, first = chain.motions(WHISKER, textures, robustness.LENGTH, taught, 0.11)
    assert first == pytest.approx(71.65, abs=0.1)
    people = chain.populations(5 * moved, rng=np.random.default_rng(3))
    spikes = {name: one.expected(5 * moved, 60).sum((1, 2)).mean() for name, one in people.items()}
    np.testing.assert_allclose(list(spikes.values()), spikes["envelope"], rtol=1e-9)
    per_unit = people["spectrum"].expected(5 * moved, 1).mean(0)[:, 0] - people["spectrum"].baseline * 0.6
    assert np.ptp(per_unit) / per_unit.mean() < 1e-6


def test_the_claim_holds_over_height_and_over_speed_where_the_speed_is_known(data):
    claim, blind = data.sel(decoder=CLAIM), data.sel(decoder="envelope over time")
    assert claim.decoder_accuracy[0] > 0.8
    assert claim.kept_share.sel(arm="height") > 0.7
    assert claim.kept_share.sel(arm="speed") > blind.kept_share.sel(arm="speed") + 0.3
    assert blind.decoder_accuracy[0] > 0.8
    np.testing.assert_allclose(data.decoder_accuracy, data.accuracy_of_set.mean("texture_set"))
    assert np.all(data.envelope_lead.sel(decoder=CLAIM) == 0)


def test_angle_acts_on_the_gain_and_the_verdict_says_so(data):
    assert data.tested_envelope[-1] < 0.6 * data.tested_envelope[0]  # the base angle sets the gain
    angle = data.tested_arm == "angle"
    assert data.decoder_accuracy.sel(decoder=CLAIM)[angle].item() < 0.7
    assert data.attrs["verdict"].count("keeps") == 3
    assert "speed:" in data.attrs["verdict"]
    assert "at chance" not in data.attrs["verdict"]  # an interval that reaches chance does not show that it is chance


def test_ways_differ_in_one_respect():
    ways = robustness.ways(POSTURE, 0.1)
    assert [way.arm for way in ways] == ["taught"] + ["speed"] * 4 + ["height"] * 4 + ["angle"] * 4
    for way in ways[1:]:
        assert (way.speed == 0.1) == (way.arm != "speed")
        assert np.isclose(way.height, ways[0].height) == (way.arm != "height")
        assert np.isclose(way.posture.base_angle, 1.2) == (way.arm != "angle")
    with refusal("range", "other speeds"):
        robustness.ways(POSTURE, 0.1, speeds=(1.0,))
    with refusal("range", "sets, trials and gratings of a set"):
        robustness.compute(WHISKER, ways, rng=np.random.default_rng(1), n_sets=1)
    with refusal("range", "speed"):
        robustness.compute(WHISKER, robustness.ways(POSTURE, 0.1, speeds=(3.6,)), rng=np.random.default_rng(1))


def test_drawing_labels_every_axis(data):
    figure = robustness.draw(data)
    figure.savefig(io.BytesIO())
    assert len(figure.axes) == 5
    for axis in figure.axes:
        assert axis.get_xlabel()
        assert axis.get_title(loc="left")
