// SPDX-License-Identifier: MIT
// Reads a tactile probe with an AD7746 breakout and prints a line for each pair of readings: `palpate record
// serial:PORT` reads them. Registers: AD7746 data sheet, rev. 0. Run on a simulated ATmega328P with a simulated AD7746;
// not tried on hardware.
//
//   breakout   Uno          other boards
//   VDD        5V           the supply of their pins: 3.3 V where the pins have 3.3 V
//   GND        GND          GND
//   SDA        A4 (SDA)     SDA
//   SCL        A5 (SCL)     SCL
//   CIN1+      hard gauge, one end
//   CIN2+      soft gauge, one end
//   EXCB       both gauges, the other end
// Not connected: CIN1-, CIN2-, EXCA, RDY#, VIN, REFIN. Pull-ups of SDA and SCL, 4.7 to 10 kOhm to VDD, are on most
// breakouts. A screen of the cables goes to GND.
//
// The letter c, sent to the board, centres both channels again: the range moves, so a new recording is needed.
// A line that begins with # is for people. The other lines:
//   seq=12,t_hard_us=331016,t_soft_us=344252,hard_raw=8412345,soft_raw=8398765,status=0*5A
// t: middle of the conversion, us, wraps after 2^32. raw: code of 24 bits. status: sum of 1 (hard saturated), 2 (soft
// saturated), 4 (EXCERR). After *: exclusive or of all characters before it. A pair that failed leaves a gap in seq.

#include <Wire.h>

namespace {

constexpr uint32_t baud = 115200, bus_Hz = 100000;
constexpr byte address = 0x48, reset = 0xBF;
enum Register : byte { STATUS, CAP_DATA, CAP_SETUP = 0x07, EXC_SETUP = 0x09, CAPDAC_A = 0x0B };
constexpr byte excerr = 0x08, rdycap = 0x01;         // STATUS
constexpr byte capen = 0x80, cin2 = 0x40;            // CAP_SETUP
constexpr byte excb = 0x20, half_supply = 0x03;      // EXC_SETUP: the pin, and the level +-VDD/2
constexpr byte excitation = excb | half_supply;      // without bits for EXCA: that pin is not driven
constexpr byte single = 0x02;                        // CONFIG: CAPF 0, one conversion
constexpr byte dac_enable = 0x80, dac_steps = 0x7F;  // CAPDAC: one step is about 0.164 pF
constexpr uint32_t conversion_us = 11000, too_late_us = 2 * conversion_us;
constexpr uint32_t zero = 0x800000, last = 0xFFFFFF, margin = 500;  // a code nearer to an end is saturated

struct Channel {
  byte setup;          // of CAP_SETUP
  byte capdac;         // steps, the same for all conversions
  uint32_t begun_us;   // of the conversion that runs
  uint32_t middle_us;  // of the last one
  uint32_t code;
  bool excitation_failed;

  bool saturated() const { return code < margin || code > last - margin; }
};

Channel hard = {capen, 0, 0, 0, 0, false}, soft = {capen | cin2, 0, 0, 0, 0, false};
bool centred = false, measured = false, failed = false;
uint32_t seq = 0;

bool write(byte first, const byte* bytes, byte count) {
  Wire.beginTransmission(address);
  Wire.write(first);
  Wire.write(bytes, count);
  return Wire.endTransmission() == 0;
}

bool read(byte first, byte* bytes, byte count) {
  Wire.beginTransmission(address);
  Wire.write(first);
  if (Wire.endTransmission(false) != 0 || Wire.requestFrom(address, count) != count) {
    return false;
  }
  for (byte i = 0; i < count; ++i) {
    bytes[i] = Wire.read();
  }
  return true;
}

// CONFIG, which begins the conversion, comes last.
bool begin(Channel& channel) {
  const byte capdac = dac_enable | channel.capdac, setup[] = {channel.setup, 0, excitation, single};
  const bool written = write(CAPDAC_A, &capdac, 1) && write(CAP_SETUP, setup, sizeof setup);
  channel.begun_us = micros();
  return written;
}

// The bus is silent during the conversion, whose time may be 5 % shorter than the data sheet says.
bool wait(const Channel& channel) {
  byte status = rdycap;
  while (status & rdycap) {
    const uint32_t waited = micros() - channel.begun_us;
    if (waited > too_late_us || (waited > conversion_us / 10 * 9 && !read(STATUS, &status, 1))) {
      return false;
    }
  }
  return true;
}

// One transfer for data and settings. If the settings are not as written, the chip had no supply for a moment, or the
// data are of another channel.
bool finish(Channel& channel) {
  byte chip[CAPDAC_A + 1];
  if (!wait(channel) || !read(STATUS, chip, sizeof chip)) {
    return false;
  }
  channel.middle_us = channel.begun_us + conversion_us / 2;
  channel.code = uint32_t(chip[CAP_DATA]) << 16 | uint32_t(chip[CAP_DATA + 1]) << 8 | chip[CAP_DATA + 2];
  channel.excitation_failed = chip[STATUS] & excerr;
  return !(chip[STATUS] & rdycap) && chip[CAP_SETUP] == channel.setup && chip[EXC_SETUP] == excitation &&
         chip[CAPDAC_A] == (dac_enable | channel.capdac);
}

bool convert(Channel& channel) { return begin(channel) && finish(channel); }

// The CAPDAC is subtracted from the input. Search the largest one that leaves a code above the middle.
bool centre(Channel& channel) {
  channel.capdac = 0;
  for (byte bit = (dac_steps + 1) / 2; bit; bit /= 2) {
    channel.capdac |= bit;
    if (!convert(channel)) {
      return false;
    }
    if (channel.code < zero) {
      channel.capdac &= ~bit;
    }
  }
  return convert(channel);
}

void describe(const __FlashStringHelper* name, const Channel& channel) {
  Serial.print(F("# "));
  Serial.print(name);
  Serial.print(F(": CAPDAC "));
  Serial.print(channel.capdac);
  Serial.print(F(", code "));
  Serial.println(channel.code);
  if (channel.excitation_failed) {
    Serial.println(F("# EXCERR: EXCB is shorted or has too large a load"));
  } else if (channel.saturated()) {
    Serial.println(F("# out of range: more than 17 pF, less than 0 pF, or a short"));
  } else if (channel.capdac == 0) {
    Serial.println(F("# less than 0.2 pF: is the gauge connected, its other end to EXCB?"));
  }
}

bool start() {
  Wire.beginTransmission(address);
  Wire.write(reset);
  Wire.endTransmission();
  delay(1);
  Serial.println(F("# AD7746, CAPF 0, excitation EXCB for both inputs, level 3: +-VDD/2"));
  if (!centre(hard) || !centre(soft)) {
    return false;
  }
  describe(F("hard, CIN1"), hard);
  describe(F("soft, CIN2"), soft);
  return true;
}

// Prints, and computes the exclusive or of what is printed.
struct Summed : Print {
  byte sum = 0;
  size_t write(uint8_t character) override {
    sum ^= character;
    return Serial.write(character);
  }
  using Print::write;
  void field(const __FlashStringHelper* name, uint32_t value) {
    print(name);
    print(value);
  }
};

void print_pair(uint32_t number) {
  const byte status =
      hard.saturated() | soft.saturated() << 1 | (hard.excitation_failed || soft.excitation_failed) << 2;
  Summed line;
  line.field(F("seq="), number);
  line.field(F(",t_hard_us="), hard.middle_us);
  line.field(F(",t_soft_us="), soft.middle_us);
  line.field(F(",hard_raw="), hard.code);
  line.field(F(",soft_raw="), soft.code);
  line.field(F(",status="), status);
  Serial.print(line.sum < 0x10 ? F("*0") : F("*"));
  Serial.println(line.sum, HEX);
}

void fail() {
  if (!failed) {
    Serial.println(F("# AD7746 at 0x48: no answer, or not as set. Check VDD, GND, SDA, SCL. It is tried again."));
  }
  failed = true;
  delay(100);
}

}  // namespace

void setup() {
  Serial.begin(baud);
  Wire.begin();
  Wire.setClock(bus_Hz);
#ifdef WIRE_HAS_TIMEOUT
  Wire.setWireTimeout(25000, true);  // us: a wire that is held low must not stop the program
#endif
}

void loop() {
  if (Serial.read() == 'c') {
    centred = measured = false;
  }
  if (!centred) {
    centred = start();
  }
  const bool begun = centred && begin(hard);
  if (measured) {
    print_pair(seq - 1);  // while the converter works
  }
  measured = begun && finish(hard) && convert(soft);
  seq += centred;
  if (!measured) {
    fail();
  } else if (failed) {
    Serial.println(F("# AD7746 answers again"));
    failed = false;
  }
}
