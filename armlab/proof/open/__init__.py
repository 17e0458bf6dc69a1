"""What is judged on open data: real arms, peers, relations that need no truth, coverage, learnt numbers."""
