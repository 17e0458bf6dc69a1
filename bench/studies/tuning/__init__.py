"""The same tuning budget for every algorithm on training problems, judged on problems that took no part."""
