"""All real arms: identification and diagnosis of the public recordings, judged alike on the same runs."""
