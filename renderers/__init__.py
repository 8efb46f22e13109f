"""The competitors. See README.md for the contract and SPEC.md for the light model."""
