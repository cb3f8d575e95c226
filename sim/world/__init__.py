"""The world: terrain, trees and walls, with the same exact queries on the host and in kernels."""
