"""Models with missing physics as files of simulators, as far as these have the physics."""
