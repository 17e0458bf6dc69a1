"""Forward simulation of a measured run in short windows: does the new model move as the arm did?"""
