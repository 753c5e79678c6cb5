"""Discrimination of textures by spikes, its robustness to changes of the scan, and the trials that a fit needs."""

from __future__ import annotations

from vibrissa.quantities.quantity import Quantity, ends, ranged

DISCRIMINATION: dict[str, Quantity] = {
    # which texture was it
    "code": Quantity(("code",), "1", "what is read of the spikes"),
    "presented": Quantity(("presented",), "1", "texture presented"),
    "answered": Quantity(("answered",), "1", "texture answered"),
    "contrast": Quantity(("contrast",), "1", "two textures to be discriminated"),
    "accuracy": Quantity(("code",), "1", "share of held-out trials answered rightly, every texture counted alike"),
    **ends("accuracy", ("code",), "1", "accuracy"),
    "chance_accuracy": Quantity(("code",), "1", "mean accuracy with permuted textures"),
    "chance_accuracy_high": Quantity(("code",), "1", "accuracy that 5 % of the permutations exceed"),
    "code_p_value": Quantity(("code",), "1", "share of permutations at least as accurate"),
    "code_adjusted_p_value": Quantity(("code",), "1", "p-value adjusted over codes, Benjamini and Hochberg"),
    "code_verdict": Quantity(("code",), "1", "tells the textures apart, or cannot tell"),
    "accuracy_gain": Quantity(("code",), "1", "accuracy less that of the mean rate on the same trials"),
    **ends("accuracy_gain", ("code",), "1", "gain over the mean rate"),
    "confusion": Quantity(("code", "presented", "answered"), "1", "share of the held-out trials of a texture"),
    "auc": Quantity(
        ("code", "contrast"), "1", "area under the ROC curve: chance that the trial of the first looks more so"
    ),
    **ends("auc", ("code", "contrast"), "1", "area under the ROC curve"),
    **ranged("d_prime", ("code", "contrast"), "1", "sensitivity d′ = √2 Φ⁻¹(area under the ROC curve)", "d′"),
    "trial_texture": Quantity(("trial",), "1", "texture presented in a trial"),
    "held_out_score": Quantity(
        ("code", "trial", "presented"),
        "1",
        "log posterior of a texture, mean over decoders that have not seen the trial",
    ),
    "units_used": Quantity(("units_used",), "1", "number of units read"),
    "accuracy_by_units": Quantity(("code", "units_used"), "1", "accuracy, mean over draws of this number of units"),
    "accuracy_by_units_low": Quantity(("code", "units_used"), "1", "accuracy that 1 in 10 draws of units falls below"),
    "accuracy_by_units_high": Quantity(("code", "units_used"), "1", "accuracy that 1 in 10 draws of units exceeds"),
    "roc_false": Quantity(("roc_false",), "1", "share of the second texture's trials called the first"),
    "roc_true": Quantity(("code", "roc_false"), "1", "share of the first texture's trials called so, mean over pairs"),
    # trained at one speed, height and angle, tested at others
    "decoder": Quantity(("decoder",), "1", "what is read of a population, and what the reader knows"),
    "tested": Quantity(("tested",), "1", "condition in which trials are read; the first taught the decoders"),
    "tested_arm": Quantity(("tested",), "1", "what differs from the condition that taught"),
    "tested_speed": Quantity(("tested",), "m/s", "scanning speed"),
    "tested_height": Quantity(("tested",), "1", "height of the base above the substrate, over L"),
    "tested_angle": Quantity(("tested",), "rad", "angle of the shaft at the base to the substrate"),
    "tested_resonance": Quantity(("tested",), "Hz", "first resonance"),
    "tested_envelope": Quantity(("tested",), "m", "mean envelope near the base, after the stimulus is scaled"),
    "decoder_accuracy": Quantity(("decoder", "tested"), "1", "share of trials answered rightly"),
    **ends("decoder_accuracy", ("decoder", "tested"), "1", "accuracy", "interval over sets"),
    "accuracy_of_set": Quantity(("decoder", "tested", "texture_set"), "1", "accuracy for one set of textures"),
    "arm": Quantity(("arm",), "1", "what differs from the condition that taught"),
    "kept_share": Quantity(
        ("decoder", "arm"), "1", "accuracy above chance in the other conditions over that where it was taught"
    ),
    **ends("kept_share", ("decoder", "arm"), "1", "share kept", "interval over sets"),
    "envelope_lead": Quantity(
        ("decoder", "tested"), "1", "accuracy of the envelope over distance at any gain, less that of the decoder"
    ),
    **ends("envelope_lead", ("decoder", "tested"), "1", "lead of the envelope"),
    "arm_lead": Quantity(("decoder", "arm"), "1", "lead of the envelope, mean over the arm's conditions"),
    **ends("arm_lead", ("decoder", "arm"), "1", "lead over the arm", "interval over sets"),
    "shown_place": Quantity(("shown_place",), "m", "distance scanned"),
    "shown_envelope": Quantity(("tested", "shown_place"), "m", "envelope of one texture, scaled, over distance"),
    # how many trials a fit needs
    "trials_needed": Quantity(("unit",), "1", "trials until all intervals wanted are as narrow as wanted"),
    "trials_for_threshold": Quantity(("unit",), "1", "trials until the threshold's interval is as narrow as wanted"),
    "trials_for_slope": Quantity(("unit",), "1", "trials until the slope's interval is as narrow as wanted"),
    "trials_for_latency": Quantity(("unit",), "1", "trials until the latency's interval is as narrow as wanted"),
    "spikes_per_trial": Quantity(("unit",), "1", "spikes expected in the bins that count of one trial"),
    "planned_trials": Quantity(("planned_trials",), "1", "number of trials"),
    "threshold_within": Quantity(("unit", "planned_trials"), "m", "half of the threshold's 95 % interval expected"),
    "slope_within": Quantity(("unit", "planned_trials"), "1/(s m)", "half of the slope's 95 % interval expected"),
    "latency_within": Quantity(("unit", "planned_trials"), "s", "half of the latency's 95 % interval expected"),
    "planned_threshold": Quantity(("planned_threshold",), "m", "threshold of a unit to be recorded"),
    "planned_slope": Quantity(("planned_slope",), "1/(s m)", "slope of a unit to be recorded"),
    "trials_map": Quantity(("planned_slope", "planned_threshold"), "1", "trials until the threshold is known so well"),
}
