# The diffusion prior: network, schedules, samplers, training.
