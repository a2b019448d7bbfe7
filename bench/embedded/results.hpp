// SPDX-License-Identifier: MIT
#pragma once

// Results of a subject for the readings, as bits.

/// Print a text: each program defines it.
void put(const char* text);
/// Print all results.
void run();
/// Print a line for each subject, with a hash of all its states, and a line for each touch.
void print_results();
