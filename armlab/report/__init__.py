"""What people read: summaries, pages and pictures of the engines below, and the files beside them."""
