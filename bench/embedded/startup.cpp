// SPDX-License-Identifier: MIT
// Startup code of a Cortex-M, and output of text to the host by semihosting, which QEMU and debuggers have.

#include <cstdint>

#include "readings.hpp"

extern "C" {
extern std::uint32_t data_image, data_start, data_end, bss_start, bss_end;

void stack_top();  // of firmware.ld
[[noreturn]] void reset();
[[noreturn]] void halt() {
  put("halted\n");
  for (;;) {
  }
}
}

namespace {

std::uintptr_t semihost(std::uintptr_t operation, std::uintptr_t argument) {
  register std::uintptr_t r0 __asm__("r0") = operation;
  register std::uintptr_t r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

constexpr std::uintptr_t write0 = 0x04, exit_program = 0x18, application_exit = 0x20026;

using Handler = void (*)();
[[gnu::section(".vectors"), gnu::used]] const Handler vectors[] = {stack_top, reset,   halt,    halt,    halt,    halt,
                                                                   halt,      nullptr, nullptr, nullptr, nullptr, halt,
                                                                   halt,      nullptr, halt,    halt};

}  // namespace

void put(const char* text) { semihost(write0, reinterpret_cast<std::uintptr_t>(text)); }

extern "C" void reset() {
#if defined(__ARM_FP)
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88) |= 0xFu << 20;  // CPACR: coprocessors 10 and 11, the FPU
  __asm__ volatile("dsb\n\tisb" ::: "memory");
#endif
  for (std::uint32_t *from = &data_image, *to = &data_start; to < &data_end;) {
    *to++ = *from++;
  }
  for (std::uint32_t* to = &bss_start; to < &bss_end;) {
    *to++ = 0;
  }
  run();
  semihost(exit_program, application_exit);
  for (;;) {
  }
}
