# Pure numerics.
