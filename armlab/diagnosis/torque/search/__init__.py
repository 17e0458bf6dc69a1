"""The search for effects that explain what rigid links leave."""
