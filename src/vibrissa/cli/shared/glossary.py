"""Every option of every verb: one name, one meaning, one dimension. `docs/make_options.py` draws the page from it."""

from __future__ import annotations

from vibrissa.cli.shared.glossary_entry import Option

_O = Option
GLOSSARY: dict[str, Option] = {
    # the whisker and how it is held
    "--whisker.length": _O(
        "length", "Length L of the nontruncated cone", "40mm", arguments=("length", "whisker_length")
    ),
    "--whisker.cone-angle": _O("angle", "Cone angle α, base radius over L", "1.5mrad", arguments=("cone_angle",)),
    "--whisker.tip": _O(
        "over length", "Position of the physical tip, from the tip of the cone", "2mm", arguments=("tip",)
    ),
    "--whisker.youngs-modulus": _O("pressure", "Young's modulus", "3.74GPa", 1e3, arguments=("youngs_modulus",)),
    "--whisker.density": _O("density", "Density", "1.14g/cm^3", 10, arguments=("density",)),
    "--atlas": _O("text", "A measured rat whisker by its name instead of its numbers", "C2"),
    "--contact": _O(
        "over length",
        "Position of the contact along the shaft: 0 at the tip of the cone, 1 at the base; a length is the "
        "distance from the tip of the cone along the shaft",
        "11.6mm",
        arguments=("contact", "flat_contact"),
    ),
    "--base-distance": _O("over length", "Height of the base above the substrate", "18.5mm", arguments=("height",)),
    "--base-angle": _O("angle", "Angle of the shaft at the base to the substrate", "70deg"),
    "--friction": _O("number", "Coefficient of friction of the substrate", "0.4"),
    "--adhesion": _O("number", "Strength b of adhesive friction; 0 for Coulomb's", "0.1"),
    "--contact-distance": _O("over length", "Distance of an edge from the base along the substrate", "19mm"),
    "--diameters": _O("file", "Table of diameters along a whisker", "diameters.csv"),
    "--physical-length": _O("length", "Length of the whisker from its base to its physical tip", "35mm", most=1),
    "--tracked": _O("file", "Tracked profiles of one whisker", "profile.nc"),
    "--resonance-file": _O(
        "file", "Resonances and damping of a whisker that a study found", "resonance.nc", arguments=("resonances",)
    ),
    "--resonances": _O("flag", "Single whiskers whose resonances were measured"),
    "--name": _O("text", "Name of a whisker", "C2", arguments=("name", "names")),
    # modes, gaps, scans
    "--n-modes": _O("count", "Number of modes", "3", arguments=("n_modes", "count", "number_of_modes")),
    "--boundary": _O("choice", "Boundary condition at the contact", "free"),
    "--about": _O("choice", "Modes of a straight shaft, or about the curved profile", "profile"),
    "--modes": _O("choice", "Modes that carry the motion: of a straight shaft, or about the curved profile", "curved"),
    "--contact-condition": _O(
        "choice", "Motion of the contact in modes about the profile", "edge", arguments=("condition",)
    ),
    "--friction-law": _O("choice", "Friction in modes about the profile", "coulomb", arguments=("law",)),
    "--gap-width": _O("over length", "Width of the gap", "0.6mm"),
    "--gap-depth": _O("length", "Depth of the gap", "35um", most=1e-2, arguments=("depth",)),
    "--texture": _O("file", "Gaps or surface that is drawn past the whisker", "grating.csv"),
    "--path": _O("file", "Table of the posture in time", "path.csv"),
    "--speed": _O(
        "speed", "Speed of the texture past the base", "100mm/s", arguments=("speed", "scan_speed", "scanning_speed")
    ),
    "--damping": _O("number", "Damping ratio of every mode", "0.11"),
    "--response": _O("choice", "Quasi-static response of the profile: exact, or the paper's linear one", "linear"),
    "--jump": _O("choice", "Change of the velocity where the contact jumps", "paper2014"),
    "--sampling-rate": _O("rate", "Samples per second", "20kHz", 10),
    "--model": _O("choice", "Model: modes of a shaft with a single contact, or the whole whisker", "rod"),
    "--intrinsic-curvature": _O("text", "Curvature of the free shaft: a number [1/m], a table of it, or atlas", "15"),
    "--flip-curvature": _O("flag", "Turn a curved whisker about its shaft: curvature of the other sign"),
    "--hold-contact": _O("flag", "Hold the base where the curved shaft touches the flat in the contact"),
    "--damping-about": _O(
        "choice", "Modes that have the damping ratio: in contact, or in the air", "air", arguments=("about",)
    ),
    "--surface-distance": _O("length", "Distance from the base to x = 0 of the surface", "20mm", most=1),
    "--edge-radius": _O("length", "Radius of the upper edges of gaps", "20um", most=1e-3),
    "--thick": _O("flag", "The ground touches the surface of the shaft, not its midline"),
    "--follicle-rotation": _O("number", "Stiffness of the follicle against rotation of the base, over EI/L", "3"),
    "--follicle-translation": _O(
        "number", "Stiffness of the follicle against translation of the base, over EI/L³", "100"
    ),
    "--node": _O(
        "length", "Distance from the base of a point whose motion is written", "5mm", most=0.2, arguments=("nodes",)
    ),
    "--distance": _O(
        "length",
        "Distance from the base of the point that is replayed, or whose envelope drives units",
        "5mm",
        most=0.2,
    ),
    "--reverse": _O("flag", "Scan the texture in the other direction", arguments=("flip",)),
    "--line": _O("text", "Line of a map of heights", "x:12"),
    "--part": _O("length", "FIRST:LAST of the part of a surface to read, from its first point", "60mm:90mm", most=10),
    "--x-unit": _O("text", "Unit of the positions of a surface that states none", "mm"),
    "--z-unit": _O("text", "Unit of the heights of a surface that states none", "um"),
    "--fill": _O("flag", "Straight lines across points that were not measured"),
    "--levelling": _O("choice", "Whether the tilt of a surface is removed", "line", arguments=("level",)),
    "--simulate-units": _O(
        "text", "Number of units that listen to the whisker, or a table of them", "50", arguments=("units",)
    ),
    "--mean-envelope": _O("length", "Mean envelope to which the motion is scaled", "55um", most=1e-2),
    # maps
    "--seeds": _O("text", "Seeds of random gratings, a map for each", "0:99:100"),
    "--grating-length": _O("length", "Length of a random grating", "20mm", most=1, arguments=("length",)),
    "--mean-period": _O(
        "length",
        "Mean of one land and one gap of a random grating together",
        "0.6mm",
        most=0.1,
        arguments=("mean_period", "mean_periods"),
    ),
    "--reading": _O("choice", "How the widths of a random grating are drawn", "widths"),
    "--quantity": _O("choice", "Quantity that is mapped", "rms"),
    "--point": _O(
        "over length",
        "Point of the shaft whose largest displacement is mapped, from the tip of the cone",
        "36mm",
        arguments=("node",),
    ),
    "--least-linearity": _O("number", "Least exact jump over the linear one", "0.8"),
    # signals at the base
    "--signal": _O("file", "Signal measured at a whisker's base", "robot.csv"),
    "--kind": _O("choice", "Quantity that the sensor measures", "moment"),
    "--signal-unit": _O(
        "text", "Unit of the numbers of a signal or a stimulus", "V", arguments=("signal_unit", "unit")
    ),
    "--calibration": _O("number", "Quantity per unit of the reading", "2e-7"),
    "--column": _O("text", "Column of a table, or channel of a .wav", "moment"),
    "--rest": _O("duration", "Start and end of a time without touch", "0s 1s"),
    "--guess": _O("rate", "Approximate frequency of a resonance", "123Hz"),
    "--texture-start": _O(
        "duration", "Time in the file at which x = 0 of the texture meets the contact", "15ms", arguments=("start",)
    ),
    "--gratings": _O("count", "Other textures whose predictions give the agreement by chance", "39"),
    # movies
    "--movie": _O("file", "Movie of whiskers, tracked, or written of the whole whisker", "movie.mkv"),
    "--frame-rate": _O("rate", "Frames per second of the acquisition", "2kHz", 10),
    "--pixel-size": _O("length", "Side of a pixel in the plane of the whiskers", "95um"),
    "--scale-point": _O(
        "point", "COLUMN,ROW of one end of an object of known size; twice", "10,10", arguments=("scale",)
    ),
    "--scale-length": _O("length", "Distance between the two points of --scale-point", "10mm", most=1),
    "--drop-frames": _O(
        "choice",
        "Treatment of frames that time stamps or the numbers of images miss: nan makes them missing frames",
        "nan",
    ),
    "--seed-point": _O(
        "point", "COLUMN,ROW of a point of a whisker; once for each", "60,32", arguments=("seeds", "seed")
    ),
    "--tracking": _O("choice", "Whiskers followed from the first frame on, or lines of all frames linked", "link"),
    "--mark": _O(
        "text",
        "FRAME,COLUMN,ROW,NAME of a point of a whisker in any frame; names it",
        "0,120,87,C2",
        arguments=("marks", "mark"),
    ),
    "--mark-file": _O("file", "Table of marks: frame, column, row, whisker", "marks.csv"),
    "--segments": _O("file", "Lines of all frames and which whisker each is linked to", "lines.nc"),
    "--skin": _O("point", "COLUMN,ROW of the point where a whisker leaves the skin; once for each", "50.5,57"),
    "--head": _O("text", "File with two tracked points of the head in every frame, or find", "head.csv"),
    "--head-points": _O("text", "Names of a caudal and of a rostral keypoint of the head", "neck,nose"),
    "--substrate": _O("point", "COLUMN,ROW of a point of the line of the substrate; twice", "0,430"),
    "--base": _O("choice", "Side of the image on which the whiskers leave the skin", "left"),
    "--polarity": _O("choice", "Whiskers darker or brighter than the background", "bright"),
    "--region": _O("point", "C0,R0,C1,R1 of the part of the image that is searched", "20,10,480,300"),
    "--lamp": _O("point", "C0,R0,C1,R1 of the lamp that lights as the texture arrives, or `find`", "find"),
    "--start": _O("text", "First frame that is tracked, from 0, or its time", "0.1s"),
    "--stop": _O("text", "First frame after it that is not tracked, or its time", "0.9s"),
    "--background": _O("text", "Background of the whiskers: space, mean, median or a file", "mean"),
    "--estimator": _O("choice", "Method that places the line in a column", "matched"),
    "--search": _O("count", "Largest distance of the line from where it is expected, in pixels", "4"),
    "--least-contrast": _O("number", "Signal to noise below which a column is lost", "3", arguments=("threshold",)),
    "--least-probability": _O("number", "Probability of a name from which on a linked line has it", "0.9"),
    "--node-spacing": _O("length", "Arc length between nodes", "0.5mm", most=0.1),
    "--preview": _O("file", "Picture or movie of the tracking", "sheet.png"),
    "--page": _O("flag", "Work on a local page"),
    "--edits": _O("file", "File of the edits by hand (JSON)", "profile.edits.json"),
    "--browser": _O("flag", "Open the page in the browser"),
    "--measurements": _O("file", "WHISK's .measurements", "movie.measurements"),
    "--identity": _O("choice", "Source of a segment's whisker", "longest"),
    "--only-identity": _O("count", "Identity of a whisker to take; once for each", "0", arguments=("whiskers",)),
    "--keypoints": _O(
        "text", "Names of the keypoints of a whisker, base first, with commas between", "base,middle,tip"
    ),
    "--least-likelihood": _O("number", "Likelihood below which keypoints are left out", "0.6"),
    "--profile": _O("file", "Tracked profiles", "profile.nc"),
    "--which": _O("count", "Number of the tracked whisker in the file, from 0", "0"),
    "--method": _O("choice", "How modes are found in profiles", "least-squares"),
    "--fit-friction": _O("flag", "Fit the coefficient of friction too"),
    "--excursion": _O("length", "Mean excursion of the contact by a texture, along the scan", "-100um", most=0.1),
    "--excursion-sd": _O("length", "Standard deviation of that mean", "100um", most=0.1),
    "--length-sd": _O("length", "Standard deviation of the whisker's length", "0.5mm", most=0.1),
    "--face": _O("point", "COLUMN,ROW of a caudal, then of a rostral point of the line of the face; twice", "12,200"),
    "--nose": _O("choice", "Side of the image to which the nose points", "top"),
    "--dorsal": _O("choice", "Side of the image to which the back points, in a view from the side", "top"),
    "--base-part": _O(
        "length", "START STOP of the arc length on which direction and curvature are measured", "0mm 2mm"
    ),
    "--whisking-band": _O("rate", "LOW HIGH of the band of whisking", "4Hz 30Hz"),
    "--bridged": _O("count", "Longest gap of frames without the whisker that is bridged for the filter", "10"),
    "--pole": _O("point", "COLUMN,ROW of the centre of a pole", "310,120"),
    "--pole-radius": _O("length", "Radius of the pole", "0.25mm", most=0.1),
    "--wall": _O("point", "COLUMN,ROW of a point of a wall; twice", "310,0"),
    "--touch-distance": _O("length", "Largest distance of a touching centreline to a surface", "0.1mm", most=0.1),
    "--find-touches": _O("flag", "Find touches from the bending of the whisker"),
    "--least-frames": _O("count", "Frames below which a touch is left out", "2"),
    # stimuli
    "--inputs": _O("file", "Motion that is replayed, a file for each texture", "scan.nc"),
    "--duration": _O("duration", "Length of a recording or of a command", "10s"),
    "--low": _O("rate", "Lower corner of the stimulator's band", "0.1Hz"),
    "--high": _O("rate", "Upper corner of the stimulator's band", "83Hz"),
    "--order": _O("count", "Order of the filter", "4"),
    "--norm": _O("choice", "Meaning of the corners", "mag"),
    "--causal": _O("flag", "Filter once forwards; --zero-phase both ways"),
    "--fade": _O("duration", "Overlap of neighbouring textures", "50ms", most=60),
    "--ramp": _O("duration", "Time from rest into a loop, and out of it", "100ms", most=600),
    "--factor": _O("number", "Factor on the command", "0.5", arguments=("scale",)),
    "--delays": _O("text", "Delays of the copies: even, random, least, or times with commas between", "least"),
    "--separation": _O("duration", "Least time between delays", "100ms", most=60),
    "--max-travel": _O(
        "length", "Travel of the stimulator, to either side of rest", "500um", most=0.1, arguments=("travel",)
    ),
    "--max-speed": _O("speed", "Speed of the stimulator", "400mm/s", most=10, arguments=("speed",)),
    "--max-acceleration": _O(
        "acceleration", "Acceleration of the stimulator", "1000m/s^2", arguments=("acceleration",)
    ),
    "--encoding": _O("choice", "Encoding of samples in WAV", "int16"),
    "--full-scale": _O("length", "Displacement at full scale in WAV", "100um", most=0.1),
    "--measured": _O("file", "Motion of the stimulator to compare", "measured.csv"),
    "--measured-whisker": _O("text", "The whisker that was measured", "alpha"),
    # spikes
    "--spikes": _O("file", "Spikes of a recording", "spikes.csv"),
    "--spikes-out": _O("file", "File of spikes to write", "spikes.csv"),
    "--trials": _O("count", "Presentations of the stimulus", "60", arguments=("n_trials",)),
    "--event": _O("text", "Event channel that marks the onsets", "Start"),
    "--trial-table": _O("file", "Table of trials, or its name in an NWB file", "trials.csv"),
    "--only": _O("text", "COLUMN VALUE of the table of trials", "protocol texture"),
    "--stimulus": _O("file", "One presentation of the stimulus", "stimulus.csv"),
    "--command": _O("file", "Motion of all whiskers, as `vibrissa replay` wrote it", "command.nc"),
    "--whisker": _O("text", "Whisker of a command, or channel of a stimulus, that is taken", "C2"),
    "--period": _O("duration", "From one onset of the stimulus to the next", "10s"),
    "--first-onset": _O("duration", "First onset on the session's clock", "0.5s"),
    "--group": _O("text", "Kind of sorted units that are taken", "good"),
    "--unsorted": _O("flag", "Take unsorted spikes as units"),
    "--counted-bin": _O("duration", "Width of the bins of counts by bin, trial and unit", "10ms", most=1),
    "--kept": _O("file", "Table of quality whose kept units are taken", "quality.nc"),
    "--refractory-period": _O("duration", "Least interval of a single unit", "1ms", most=0.1),
    "--least-rate": _O("rate", "Rate above which a unit is kept", "1Hz"),
    "--least-snr": _O("number", "Least signal to noise of a unit that is kept", "3.1"),
    "--least-presence": _O("number", "Least share of the recording in which a unit that is kept fires", "0.9"),
    "--most-violations": _O("number", "Largest share of intervals below the refractory period", "0.005"),
    "--most-contamination": _O("number", "Largest share of foreign spikes of a unit that is kept", "0.1"),
    "--most-change": _O("number", "Largest change of rate and amplitude from start to end, over their mean", "0.5"),
    "--need-measured": _O("flag", "Leave out units for which the quantity of a rule is not measured"),
    "--envelope": _O("flag", "The stimulus is an envelope already"),
    "--null": _O("choice", "Null model that gives chance", "circular"),
    "--fit": _O("choice", "Curve that is fitted to rate against envelope", "forward"),
    "--first-segment": _O("choice", "First segment of the paper's fit", "free-first"),
    "--level": _O("number", "Largest p-value that counts as significant", "0.05"),
    "--bin-width": _O("duration", "Width of the bins", "10ms", most=1),
    "--skip": _O("duration", "Time left out at the start, while units adapt", "1s"),
    "--window": _O("duration", "START STOP of the part that is analysed", "1s 10s"),
    "--band": _O("rate", "LOW HIGH of the carrier whose envelope is taken", "50Hz 200Hz"),
    "--delay": _O("duration", "Delay at which another whisker had the same stimulus", "150ms"),
    "--spontaneous": _O("duration", "START STOP of a window without stimulus", "0s 1s"),
    "--smoothing": _O("duration", "Time constant of the smoothed envelope", "30ms", most=10),
    "--latest": _O("duration", "Longest latency searched", "30ms", most=1),
    "--reach": _O("duration", "Longest latency of a whisker's kernel", "40ms", most=1),
    "--past": _O("duration", "Longest lag of the unit's own past", "100ms", most=10),
    "--penalty": _O("number", "Penalty on the squared coefficients of whiskers", "10"),
    "--choose-penalty": _O("flag", "Choose the penalty that predicts unseen trials best"),
    "--unit": _O("text", "One unit by its name", "broad"),
    "--textures": _O("file", "Table of the texture of every trial", "textures.csv"),
    "--code": _O("choice", "Feature of the spikes that is read", "mean rate"),
    "--folds": _O("count", "Folds of the cross-validation", "5", arguments=("n_folds",)),
    "--permutations": _O("count", "Random assignments of textures to trials", "400", arguments=("n_permutations",)),
    "--units": _O("count", "Numbers of units that are drawn, once for each", "4"),
    "--speed-ratio": _O("number", "Another speed over the first, once for each", "0.5", arguments=("speeds",)),
    "--height-ratio": _O(
        "number", "Another height of the base over the first, once for each", "0.9", arguments=("heights",)
    ),
    "--angle-ratio": _O("number", "Another base angle over the first, once for each", "1.08", arguments=("angles",)),
    "--sets": _O("count", "Sets of gratings, each with its own population", "16", arguments=("n_sets",)),
    "--threshold": _O(
        "length", "Envelope above which a unit is expected to fire more, in the stimulus' unit", "42um", most=1e-2
    ),
    "--slope": _O("slope", "Rise of the rate above the threshold", "0.25/s/um", 100),
    "--baseline": _O("rate", "Rate below the threshold", "5Hz"),
    "--latency": _O("duration", "Delay from envelope to rate", "12ms", most=1),
    "--threshold-within": _O("length", "Largest half of the threshold's 95 % interval", "4um", most=1e-2),
    "--slope-within": _O("number", "Largest half of the slope's 95 % interval, over the slope", "0.2"),
    "--latency-within": _O("duration", "Largest half of the latency's 95 % interval", "2ms", most=1),
    "--gain-sd": _O("number", "Standard deviation of a gain that multiplies a trial's rate", "0.3"),
    "--fano-factor": _O("number", "Variance over mean of the counts of a bin from trial to trial", "1.5"),
    "--settled-by": _O(
        "file", "Table of the units under another stimulus, which settles envelope or phase", "other.nc"
    ),
    "--fitted-units": _O("file", "Units with their fits, as neural writes them", "units.nc"),
    # raw traces
    "--recording": _O("file", "Raw recording", "recording.dat"),
    "--channels": _O("count", "Channels of a file of bare samples", "8"),
    "--dtype": _O("choice", "Kind of the samples", "int16"),
    "--gain": _O("voltage", "Voltage of one step of the samples", "0.195uV"),
    "--pitch": _O("length", "Distance between neighbouring electrodes", "20um", most=1e-2),
    "--stream": _O("text", "Stream of a SpikeGLX or Open Ephys folder", "imec0.ap"),
    "--electrodes": _O("count", "Channels of a simulated recording", "8"),
    "--n-units": _O("count", "Units of a simulated recording", "6", arguments=("units",)),
    "--keep": _O("file", "Folder in which a simulated recording is left", "example"),
    "--sorter": _O("text", "Spike sorter", "spykingcircus2"),
    "--truth": _O("file", "True spikes, where they are known", "truth.csv"),
    # studies
    "--study": _O("file", "Study file", "study.toml"),
    "--scale": _O("choice", "Size of the built-in experiment", "paper"),
    "--dry-run": _O("flag", "Print what would be done"),
    "--table": _O("file", "Table of recorded sweeps", "sweeps.csv"),
    "--jitter": _O("count", "Sweeps whose prediction is disturbed by jitter of the tip", "10"),
    "--file": _O("file", "File that is read", "study.toml"),
    "--schema": _O("flag", "The JSON Schema of study files"),
    "--example": _O("flag", "A study file that runs as it is"),
    "--number": _O("text", "Figure of the paper, or of the report's others", "7"),
    "--results": _O("file", "Folder or dataset of results", "out"),
    "--folder": _O("file", "Folder of results", "out"),
    "--session-start": _O(
        "text", "When the session's clock was 0, with its zone", "2014-05-07T09:30:00+02:00", arguments=("start",)
    ),
    "--age": _O("text", "Age of the animal", "P90D"),
    "--sex": _O("text", "Sex of the animal", "F"),
    "--subject": _O("text", "Name of the animal", "rat7"),
    "--species": _O("text", "Latin name of the species", "Rattus norvegicus"),
    "--session": _O("text", "Name of the session", "day1"),
    "--description": _O("text", "Description of the experiment", "textures replayed"),
    "--experimenter": _O("text", "Experimenter; once for each", "Doe, Jane"),
    "--institution": _O("text", "Institution", "UNIC"),
    "--lab": _O("text", "Laboratory in which it was done", "Tactile perception"),
    "--animals": _O("file", "Table of the animals", "animals.csv"),
    "--pause": _O("duration", "Least time between two recordings on one clock", "1s"),
    "--state": _O("text", "State with which the page starts", "speed=0.15"),
    "--port": _O("count", "Port of 127.0.0.1", "8000"),
    # what every verb has
    "--seed": _O("count", "Seed of all that is drawn at random", "0"),
    "--scheduler": _O("text", "Engine for repeated work", "processes"),
    "--workers": _O("count", "Processes or threads", "4"),
    "--out": _O("file", "Where the results go: a file, or the folder of a study", "out.nc"),
    "--overwrite": _O("flag", "Replace files that exist", arguments=("overwrite", "force")),
    "--plot": _O("flag", "Draw the file too"),
    "--picture": _O("file", "Picture of the results to draw", "picture.png"),
    "--unit-page": _O("text", "Unit that has a page in the picture; once for each", "u7"),
    "--most-pages": _O("count", "Largest number of units that have a page in the picture", "100", arguments=("most",)),
    "--json": _O("flag", "One JSON object instead of a table"),
}
SHARES = {  # how the same are written over L
    "--whisker.tip": "0.05",
    "--contact": "0.29",
    "--base-distance": "0.46",
    "--contact-distance": "0.476",
    "--gap-width": "0.015",
    "--point": "0.9",
}
