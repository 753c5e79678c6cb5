"""Studies without a movie: a surface alone, base signals, texture to spikes."""
