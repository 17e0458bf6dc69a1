"""A recorded trajectory in the forms that robot controllers read."""
