"""The tiers of the proof: how the cases of each are drawn, made, asked and judged."""
