"""Ensembles: many runs of one scene, over any executor, into a Zarr store.

`twolink.ensembles.file` reads sweep files, and `twolink.ensembles.run` has `sweep`.
"""
