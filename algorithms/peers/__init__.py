"""Other packages' algorithms behind the contract of `algorithms.contract`; each is imported only when asked for."""
