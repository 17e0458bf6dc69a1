"""Which effects a planned motion can tell apart, before anyone records it."""
