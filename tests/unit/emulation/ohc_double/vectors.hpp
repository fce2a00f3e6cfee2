// Frames and the infrared messages that they must lead to. The frames were made by the standard
// host program, the messages decoded from the light of the standard controller's image.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "kilobot_wire/ohc_frame.hpp"

namespace swarmtalk::ohc_double::vectors {

struct Vector {
  const char* name;
  const char* head;       // hex of the frame's first bytes; zeros follow
  std::uint8_t checksum;  // its last byte
  std::vector<const char*> messages;
};

inline const std::vector<Vector> kVectors = {
    {"stop", "5500", 0x55, {}},
    {"led toggle", "5501", 0x54, {}},
    {"boot", "5502 000000000000000000 80", 0xD7, {"000000000000000000 80 8f18"}},
    {"reset", "5502 000000000000000000 83", 0xD4, {"000000000000000000 83 142a"}},
    {"sleep", "5502 000000000000000000 84", 0xD3, {"000000000000000000 84 ab5e"}},
    {"wake up", "5502 000000000000000000 85", 0xD2, {"000000000000000000 85 224f"}},
    {"charge", "5502 000000000000000000 86", 0xD1, {"000000000000000000 86 b97d"}},
    {"voltage", "5502 000000000000000000 87", 0xD0, {"000000000000000000 87 306c"}},
    {"run", "5502 000000000000000000 88", 0xDF, {"000000000000000000 88 c794"}},
    {"read uid 0", "5502 000000000000000000 89", 0xDE, {"000000000000000000 89 4e85"}},
    {"read uid 5", "5502 050000000000000000 89", 0xDB, {"050000000000000000 89 f519"}},
    {"read uid 15", "5502 0f0000000000000000 89", 0xD1, {"0f0000000000000000 89 9228"}},
    {"uid 1234", "5502 01d204000000000000 8a", 0x0A, {"01d204000000000000 8a f6cb"}},
    {"uid 65535", "5502 01ffff000000000000 8a", 0xDC, {"01ffff000000000000 8a ead5"}},
    {"turn left 70", "5502 020000460000000000 8a", 0x99, {"020000460000000000 8a 5070"}},
    {"turn right 68", "5502 030000004400000000 8a", 0x9A, {"030000004400000000 8a c1d1"}},
    {"straight 62 65", "5502 04000000003e410000 8a", 0xA6, {"04000000003e410000 8a 2cb8"}},
    {"save", "5502 000000000000000000 8a", 0xDD, {"000000000000000000 8a d5b7"}},
    {"size 2", "5502 020000000000000000 82", 0xD7, {"020000000000000000 82 d363"}},
    {"user 1 to 9", "5502 010203040506070809 00", 0x56, {"010203040506070809 00 18a7"}},
    {"user hello", "5502 68656c6c6f00000000 05", 0x30, {"68656c6c6f00000000 05 cb7b"}},
    {"user ones", "5502 ffffffffffffffffff 7f", 0xD7, {"ffffffffffffffffff 7f 6d03"}},
    {"single", "5506 010203040506070809 00", 0x52, {"010203040506070809 00 18a7"}},
    {"raw", "5503 010203040506070809 00 18a7", 0xE8, {"010203040506070809 00 18a7"}},
    {"positions",
     "5505 0100100020000500 020030004000ff07",
     0xEE,
     {"010010002000050000 01 6611", "020030004000ff0700 01 ce73"}},
};

/// The 22 messages of page 0 of a program whose byte i is (7 i + 3) mod 256. The last one's bytes 4
/// to 7, and so its CRC, come from other memory of the controller.
inline const std::vector<const char*> kPageMessages = {
    "0000030a11181f260081c066", "00032d343b4249500081783b",
    "0006575e656c737a0081ef32", "000981888f969da40081cd1d",
    "000cabb2b9c0c7ce0081b42e", "000fd5dce3eaf1f800812a70",
    "0012ff060d141b22008134de", "00152930373e454c00816efd",
    "0018535a61686f7600818ca3", "001b7d848b9299a00081f19c",
    "001ea7aeb5bcc3ca00815137", "0021d1d8dfe6edf400814c55",
    "0024fb020910171e0081ab82", "0027252c333a41480081397d",
    "002a4f565d646b720081c271", "002d7980878e959c0081560f",
    "0030a3aab1b8bfc600817b37", "0033cdd4dbe2e9f0008193cc",
    "0036f7fe050c131a00816518", "003921282f363d440081764c",
    "003c4b525960676e00815fd9", "003f757c"};

/// Bytes of a hex text, blanks ignored.
inline std::vector<std::uint8_t> from_hex(const std::string& text) {
  std::vector<std::uint8_t> bytes;
  std::string digits;
  for (const char c : text)
    if (c != ' ') digits += c;
  for (std::size_t i = 0; i + 1 < digits.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(digits.substr(i, 2), nullptr, 16)));
  return bytes;
}

inline Frame frame_of(const Vector& vector) {
  Frame frame{};
  const std::vector<std::uint8_t> head = from_hex(vector.head);
  std::copy(head.begin(), head.end(), frame.begin());
  frame[kFrameBytes - 1] = vector.checksum;
  return frame;
}

/// A page of the program above.
inline std::array<std::uint8_t, 129> page_payload(std::uint8_t page, unsigned program_bytes) {
  std::array<std::uint8_t, 129> payload{};
  payload[0] = page;
  for (unsigned i = 0; i < 128; ++i)
    if (page * 128u + i < program_bytes)
      payload[1 + i] = static_cast<std::uint8_t>(7 * (page * 128u + i) + 3);
  return payload;
}

}  // namespace swarmtalk::ohc_double::vectors
