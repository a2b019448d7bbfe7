// error: Capacity must be a power of two
#include <palpate/ring.hpp>
palpate::Ring<int, 100> ring;
