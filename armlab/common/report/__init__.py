"""What all pages and figures share: templates, one stylesheet, one palette, charts, and the words they explain."""
