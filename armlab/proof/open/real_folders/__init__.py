"""Recording folders with what is known of them: diagnosed by the command line, judged by facts and by least squares."""
