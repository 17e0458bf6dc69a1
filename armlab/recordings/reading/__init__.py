"""How a recording and its robot file are to be read: mistakes of sign, order, unit, zero, mounting and clock."""
