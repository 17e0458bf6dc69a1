"""The tier of real recordings: something known is concealed in them at random."""
