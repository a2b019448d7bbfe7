// SPDX-License-Identifier: MIT
// An Arduino Uno in simavr, with a simulated AD7746 on its I2C bus and a pseudo-terminal in place of its USB port.
//   board SKETCH.elf PORT LOG PAIRS [absent|overloaded|beyond|garbled|micros=BEGIN[:END]]...
// PORT is the descriptor of the terminal's other end. The board starts when someone opens it, as a real one is reset then, and stands still
// while the port's buffer is full, so a slow reader loses nothing. Its time goes at most twice as
// fast as ours. After PAIRS lines it stands still until the port is closed. micros=S: micros() wraps after S seconds. Exit code 1: the chip was used against its data sheet, or the
// sketch needs more than 0.1 s of its time for a pair.

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "chip.hpp"

extern "C" {
#include <avr_twi.h>
#include <avr_uart.h>
#include <sim_avr.h>
#include <sim_elf.h>
}

namespace {

class Port {
 public:
  explicit Port(int end) : end_(end) {}

  bool open() const { return (ask(0) & POLLHUP) == 0; }
  void write(char byte) const {
    if (::write(end_, &byte, 1) != 1) {
      std::perror("port");
    }
  }
  int read() const {
    unsigned char byte = 0;
    return (ask(0) & POLLIN) && ::read(end_, &byte, 1) == 1 ? byte : -1;
  }

 private:
  int ask(int milliseconds) const {
    pollfd asked{end_, POLLIN, 0};
    poll(&asked, 1, milliseconds);
    return asked.revents;
  }
  int end_;
};

struct Board {
  avr_t* avr;
  Chip chip;
  Port port;
  double await_s = 1e9;  // from then on it waits for a byte
  bool selected = false, line_begins = true;
  long pairs = 0;

  double now() const { return static_cast<double>(avr->cycle) / avr->frequency; }
};

void answer(const Board& board, std::uint8_t what, std::uint8_t data) {
  avr_raise_irq(avr_io_getirq(board.avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_INPUT), avr_twi_irq_msg(what, 0x90, data));
}

void on_bus(avr_irq_t*, std::uint32_t value, void* of) {
  Board& board = *static_cast<Board*>(of);
  avr_twi_msg_irq_t message;
  message.u.v = value;
  const auto [unused, what, address, data] = message.u.twi;
  if (what & (TWI_COND_START | TWI_COND_WRITE | TWI_COND_READ)) {
    // simavr takes 1 us for a bit; here a byte takes as long as the sketch has set: 9 bits of 16 + 2 TWBR cycles.
    constexpr int twbr = 0xB8;
    board.avr->cycle += 9u * 2u * board.avr->data[twbr];
  }
  if (what & TWI_COND_START) {
    board.selected = (address & 0xFE) == 0x90 && board.chip.select(board.now());
    if (board.selected) {
      answer(board, TWI_COND_ACK, 1);
    }
  } else if (what & TWI_COND_STOP) {
    board.selected = false;
  } else if (board.selected && (what & TWI_COND_WRITE)) {
    answer(board, TWI_COND_ACK, 1);
    board.chip.write(data, board.now());
  } else if (board.selected && (what & TWI_COND_READ)) {
    answer(board, TWI_COND_READ, board.chip.read(board.now()));
  }
}

void on_uart(avr_irq_t*, std::uint32_t byte, void* of) {
  Board& board = *static_cast<Board*>(of);
  board.pairs += board.line_begins && byte == 's';  // counted at its begin, so that PAIRS + 1 ends the last line
  board.line_begins = byte == '\n';
  board.port.write(static_cast<char>(byte));
}

void set(Board& board, const elf_firmware_t& sketch, const char* option) {
  char name[16];
  double begin = 0, end = 0;
  if (std::sscanf(option, "%15[^=]=%lf:%lf", name, &begin, &end) == 3) {
    board.chip.spans.at(name) = Span{begin, end};
  } else if (!std::strcmp(name, "await")) {
    board.await_s = begin;
  } else {  // micros() has 256 ticks of 4 us in an overflow
    const auto overflows = static_cast<std::uint32_t>(4194304 - begin * 1e6 / 1024);
    for (std::uint32_t i = 0; i < sketch.symbolcount; ++i) {
      if (!std::strcmp(sketch.symbol[i]->symbol, "timer0_overflow_count")) {
        std::memcpy(board.avr->data + (sketch.symbol[i]->addr & 0xFFFF), &overflows, 4);
      }
    }
  }
}

}  // namespace

int main(int count, char** words) {
  std::FILE* const log = std::fopen(words[3], "w");
  elf_firmware_t sketch{};
  if (!log || elf_read_firmware(words[1], &sketch) != 0) {
    std::fputs("board: no such sketch, or the log cannot be written\n", stderr);
    return 2;
  }
  avr_t* const avr = avr_make_mcu_by_name("atmega328p");
  avr_init(avr);
  avr->frequency = 16000000;
  avr_load_firmware(avr, &sketch);
  Board board{avr, Chip(log), Port(std::atoi(words[2]))};

  std::uint32_t quiet = 0;
  avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &quiet);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_TWI_GETIRQ(0), TWI_IRQ_OUTPUT), on_bus, &board);
  avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), on_uart, &board);
  avr_irq_t* const input = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);

  while (!board.port.open()) {
    usleep(1000);
  }
  usleep(500000);               // a boot loader takes longer; who opens a port throws away what came before
  while (avr->cycle < 16000) {  // until the memory is 0
    avr_run(avr);
  }
  for (int i = 5; i < count; ++i) {
    set(board, sketch, words[i]);
  }
  const long pairs = std::atol(words[4]);
  const double limit = 10 + 0.1 * static_cast<double>(pairs);
  auto due = std::chrono::steady_clock::now();
  while (board.port.open() && board.pairs <= pairs && board.now() < limit) {
    for (int i = 0; i < 16000; ++i) {
      avr_run(avr);
    }
    // At most twice as fast as the computer's clock: who reads refuses a clock three times too fast as one in a wrong unit.
    due = std::max(due + std::chrono::microseconds(500), std::chrono::steady_clock::now());
    std::this_thread::sleep_until(due);
    int byte = board.port.read();
    while (byte < 0 && board.now() >= board.await_s && board.port.open()) {
      usleep(1000);
      byte = board.port.read();
    }
    if (byte >= 0) {
      board.await_s = 1e9;
      avr_raise_irq(input, static_cast<std::uint32_t>(byte));
    }
  }
  std::fclose(log);
  if (board.now() >= limit) {
    std::fputs("board: the sketch prints too few pairs\n", stderr);
    return 1;
  }
  while (board.port.open()) {
    usleep(1000);
  }
  return board.chip.faults != 0;
}
