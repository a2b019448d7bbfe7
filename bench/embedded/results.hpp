// SPDX-License-Identifier: MIT
#pragma once

// What a subject makes of the readings, as bits.

/// Text to whoever listens.
void put(const char* text);
/// All that a program prints.
void run();
/// A line for each subject, a hash of every state on the way, and one for each touch.
void print_results();
