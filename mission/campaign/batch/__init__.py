"""Many runs of a campaign in one launch of the kernels, without MAVLink."""
