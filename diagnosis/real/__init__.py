"""The public recordings of real arms diagnosed with only the rigid body given."""
