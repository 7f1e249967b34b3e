# The only C++: each library behind a small C header.
