"""Small recordings of raw samples, as other programs write them into folders."""

import json

import numpy as np

RATE = 30000.0


def noise(folder, n=60000, channels=2, dtype="int16"):
    """Bare samples of two seconds."""
    values = (20 * np.random.default_rng(0).standard_normal((n, channels))).astype(dtype)
    values.tofile(folder / "r.dat")
    return folder / "r.dat"


def open_ephys(folder):
    """A record node of two channels as the Open Ephys GUI 0.6 writes it."""
    where = folder / "Record Node 101" / "experiment1" / "recording1"
    (where / "continuous" / "Acq.A").mkdir(parents=True)
    channels = [{"channel_name": f"CH{k}", "bit_volts": 0.195, "units": "uV"} for k in (1, 2)]
    stream = {"folder_name": "Acq.A/", "sample_rate": 30000, "num_channels": 2, "channels": channels}
    stream |= {
        "source_processor_name": "Acq",
        "source_processor_id": 100,
        "stream_name": "A",
        "recorded_processor_id": 101,
    }
    told = {"GUI version": "0.6.0", "continuous": [stream], "events": [], "spikes": []}
    (where / "structure.oebin").write_text(json.dumps(told))
    noise(folder).rename(where / "continuous" / "Acq.A" / "continuous.dat")
    for name in ("timestamps", "sample_numbers"):
        np.save(
            where / "continuous" / "Acq.A" / f"{name}.npy", np.arange(60000) / (RATE if name == "timestamps" else 1)
        )
    (folder / "Record Node 101" / "settings.xml").write_text(
        "<SETTINGS><INFO><VERSION>0.6.0</VERSION></INFO></SETTINGS>"
    )
    return folder


def spikeglx(folder):
    """A run of four channels of a Neuropixels 1.0 probe, and the line of synchronisation, as SpikeGLX writes them."""
    where = folder / "run_g0" / "run_g0_imec0"
    where.mkdir(parents=True)
    noise(folder, channels=5).rename(where / "run_g0_t0.imec0.ap.bin")
    told = "typeThis=imec\nfileName=D:/run_g0_t0.imec0.ap.bin\nnSavedChans=5\nimSampRate=30000\nimAiRangeMax=0.6\n"
    told += "imAiRangeMin=-0.6\nimMaxInt=512\nimDatPrb_type=0\nimDatPrb_pn=NP1000\nimDatPrb_port=1\nimDatPrb_slot=2\n"
    told += "snsApLfSy=4,0,1\nsnsSaveChanSubset=0:3,768\n~imroTbl=(0,384)"
    told += "".join(f"({k} 0 0 500 250 1)" for k in range(384)) + "\n~snsChanMap=(384,384,1)"
    told += "".join(f"(AP{k};{k}:{k})" for k in range(4)) + "(SY0;768:768)\n"
    (where / "run_g0_t0.imec0.ap.meta").write_text(told)
    return folder
