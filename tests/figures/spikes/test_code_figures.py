"""Figures of kernels, drives, information, sorted units and commands: what is drawn is what was found."""

import numpy as np

from vibrissa.figures.spikes import command, drives, information, kernels, sorted_units
from vibrissa.quantities import dataset
from vibrissa.quantities.quantity import estimate


def ends(name, value, half=0.1):
    value = np.array(value, float)
    return estimate(name, value, value - half, value + half)


def xy(container):
    return container.lines[0].get_xydata().T.tolist()


def test_kernels_are_of_the_first_unit_to_which_a_whisker_matters():
    effect = np.array([[0.0, 0.1], [2e4, 1e4]])
    data = dataset(
        {"n_trials": 12, "level": 0.05},
        unit_name=["a", "b"],
        whisker=["C1", "C2"],
        kernel_lag=[0.0, 0.005, 0.01],
        past_lag=[0.005, 0.01],
        **ends("whisker_effect", effect, 1e3),
        **ends("whisker_kernel", np.arange(12.0).reshape(2, 2, 3) * 1e3, 1e2),
        **ends("past_kernel", [[1.0, 1.0], [0.4, 1.2]]),
        whisker_p_value=[[0.5, 0.4], [0.2, 1e-4]],
        whisker_matters=[[False, False], [False, True]],
        deviance_explained=[0.0, 0.1],
        penalty=[10.0, 10.0],
        reason=["", ""],
    )
    one = kernels.compute(data)
    assert one.attrs["drawn_whiskers"] == [1, 0]
    assert one.attrs["caption"].startswith("Unit b, 12 presentations; 1 of 2 whiskers matter")
    figure = kernels.draw(one)
    matters, others = figure.axes[0].containers
    assert xy(matters) == [[0.01], [1]]
    assert xy(others) == [[0.02], [0]]
    np.testing.assert_allclose(figure.axes[1].lines[1].get_ydata(orig=False), 1e-6 * data.whisker_kernel.values[1, 1])
    np.testing.assert_allclose(figure.axes[2].lines[1].get_ydata(orig=False), [0.4, 1.2])
    bare = kernels.draw(kernels.compute(data.isel(past_lag=[]).assign(whisker_effect=data.whisker_effect * np.nan)))
    assert [axis.texts[0].get_text()[:8] for axis in bare.axes] == ["no model", "no model", "the unit"]


def test_drives_of_each_unit_have_their_own_line():
    gain = np.array([[0.5, 0.2, 0.1, 0.3], [0.1, 0.4, 0.0, 0.2]])
    data = dataset(
        drive=["envelope", "speed", "rise", "smoothed"],
        unit_name=["a$b$", "c"],
        **ends("drive_gain", gain),
        **ends("drive_loss", gain.max(1, keepdims=True) - gain),
        best_drive=["envelope", "speed"],
        carrier_frequency=[40.0, 90.0],
    )
    found = drives.compute(data)
    assert "1 envelope, 1 speed, 0 rise, 0 smoothed, 0 cannot tell" in found.attrs["caption"]
    figure = drives.draw(found)
    for axis, name in zip(figure.axes, ("drive_gain", "drive_loss"), strict=True):
        drawn = [one.lines[0].get_xdata(orig=False) for one in axis.containers]
        np.testing.assert_allclose(drawn, data[name].values.T)
    assert figure.axes[0].get_yticklabels()[0].get_text() == "a$b$"
    many = drives.compute(data.isel(unit=[0] * 50))
    assert many.sizes["unit"] == drives.MOST
    assert "The first 40 units are drawn." in many.attrs["caption"]


def test_information_is_sorted_and_the_doubtful_are_hollow():
    bits = np.array([0.5, np.nan, 2.0])
    names = ("spike_information", "information_rate", "count_information")
    data = dataset(
        {"n_trials": 40, "bin_width": 0.01, "window": np.array([1.0, 5.0])},
        unit_name=["low", "none", "high"],
        unit_rate=[10.0, 0.0, 4.0],
        informative=[True, False, True],
        count_informative=[True, False, False],
        spike_reason=["", "too few spikes", ""],
        reason=["", "too few spikes", "too few trials"],
        **{f"{name}{end}": bits + step for name in names for end, step in (("", 0), ("_low", -0.1), ("_high", 0.1))},
        **{f"{name}_plain": bits + 0.3 for name in names},
    )
    found = information.compute(data)
    assert found.unit_name.values.tolist() == ["high", "low"]
    caption = found.attrs["caption"]
    assert "spikes of 2 and counts of 1 inform on the stimulus beyond their error" in caption
    assert "1 cannot be estimated; hollow, 0 with too few spikes in A and B, 1 with too few" in caption
    figure = information.draw(found)
    sure, doubtful = figure.axes[2].containers
    assert (xy(sure), xy(doubtful)) == ([[0.5], [1]], [[2.0], [0]])
    assert doubtful.lines[0].get_markerfacecolor() == "none"
    assert xy(figure.axes[0].containers[0]) == [[2.0, 0.5], [0, 1]]
    assert xy(figure.axes[1].containers[0]) == [[4.0, 10.0], [2.0, 0.5]]
    few = information.draw(information.compute(data.assign(spike_reason=data.reason)))
    assert xy(few.axes[0].containers[1]) == [[2.0], [0]]
    none = information.draw(information.compute(data.isel(unit=[1])))
    assert all(axis.texts for axis in none.axes)


def test_sorted_units_of_most_spikes_are_drawn_with_their_waveforms():
    counts = np.arange(14) + 3
    unit = np.repeat(np.arange(14), counts)
    time = np.concatenate([0.5 + 0.0105 * np.arange(n) for n in counts])
    shape = np.outer(np.arange(14), [0.0, -1e-6, 0.0])
    data = dataset(
        {"duration": 20.0, "sampling_rate": 1000.0, "sorter": "simple"},
        spike_time=time,
        spike_unit=unit,
        unit_name=[f"u{k}" for k in range(14)],
        unit_rate=counts / 20,
        kept=counts > 9,
        unit_waveform=shape,
    )
    found = sorted_units.compute(data)
    assert found.unit_name.values.tolist() == [f"u{k}" for k in range(2, 14)]
    assert "The 12 of most spikes are drawn." in found.attrs["caption"]
    regular = found.autocorrelogram.values[0]  # five spikes 10.5 ms apart
    assert np.flatnonzero(regular).tolist() == [10, 21, 31, 42]
    assert regular[10] == 4 / (5 * 1e-3)
    figure = sorted_units.draw(found)
    np.testing.assert_allclose(figure.axes[0].lines[-1].get_ydata(orig=False), [0, -2, 0], atol=1e-12)
    assert figure.axes[0].lines[-1].get_color() == sorted_units.BROKEN
    bare = sorted_units.draw(found.drop_vars("unit_waveform"))
    assert "no waveform" in bare.axes[0].texts[0].get_text()


def test_command_draws_its_copies_and_the_power_of_its_sine():
    time, delay = np.arange(4000) / 1000, np.linspace(0, 0.5, 6)
    copies = 1e-4 * np.sin(2 * np.pi * 30 * (time - delay[:, None]))
    numbers = {"largest_correlation": 0.4, "peak_travel": 1e-4, "peak_speed": 0.02, "peak_acceleration": 3.0}
    data = dataset(
        {"duration": 4.0, "sampling_rate": 1000.0, "filter_low": 0.1, "filter_high": 83.0},
        whisker=[f"C{k}" for k in range(6)],
        time=time,
        command=copies,
        delay=delay,
        copy_correlation=np.full(6, 0.4),
        **numbers,
    )
    found = command.compute(data)
    assert float(found.frequency[int(np.argmax(found.node_power.values))]) == 30.0
    figure = command.draw(found)
    (top,) = figure.axes[0].lines
    np.testing.assert_allclose(top.get_ydata(orig=False), 1e6 * copies[0, :2000], atol=1e-9)
    delays = next(axis for axis in figure.axes if axis.get_xlabel() == "delay [s]")
    np.testing.assert_allclose(delays.lines[0].get_xdata(orig=False), delay)
