"""Integration methods and precisions, each in one registry; they know no scene."""
