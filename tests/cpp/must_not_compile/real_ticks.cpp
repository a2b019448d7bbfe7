// error: palpate::Align: Ticks must be an integer of 32 or 64 bits
#include <palpate/palpate.hpp>
palpate::HandheldTracker<double, double> tracker;
