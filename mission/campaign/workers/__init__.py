"""Who flies the runs of a campaign: processes of this machine, Ray, or one batch in kernels."""
