"""How a diagnosis is told: a page that can be forwarded, its pictures as files, and a short text for the terminal."""
