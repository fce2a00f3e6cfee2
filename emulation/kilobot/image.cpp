#include "emulation/kilobot/image.hpp"

#include <elf.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace swarmtalk::emulator {
namespace {

constexpr std::uint16_t kElfMachineAvr = 83;
// avr-gcc's address spaces: data space at 0x800000, EEPROM at 0x810000.
constexpr std::uint32_t kDataSpace = 0x800000;
constexpr std::uint32_t kEepromSpace = 0x810000;

using Bytes = std::vector<std::uint8_t>;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

/// Copies a structure out of the file, checking that the file is long enough.
template <class T>
T read_at(const std::string& path, const Bytes& file, std::size_t offset) {
  if (offset > file.size() || file.size() - offset < sizeof(T)) fail(path, "ELF file cut short");
  T value;
  std::memcpy(&value, file.data() + offset, sizeof value);
  return value;
}

void place(const std::string& path, Image& image, std::uint32_t address, const std::uint8_t* bytes,
           std::size_t size_bytes) {
  if (address + size_bytes > kFlashBytes) fail(path, "code beyond the 32 KiB of flash");
  std::copy_n(bytes, size_bytes, image.flash.begin() + address);
  image.used_bytes += static_cast<std::uint32_t>(size_bytes);
}

void load_elf_symbols(const std::string& path, const Bytes& file, const Elf32_Shdr& table,
                      const Elf32_Shdr& names, Image& image) {
  for (std::uint32_t i = 0; i < table.sh_size / sizeof(Elf32_Sym); ++i) {
    const auto symbol = read_at<Elf32_Sym>(path, file, table.sh_offset + i * sizeof(Elf32_Sym));
    const bool in_ram = symbol.st_value >= kDataSpace && symbol.st_value < kEepromSpace;
    if (!in_ram || symbol.st_name >= names.sh_size) continue;
    const std::size_t start = names.sh_offset + symbol.st_name;
    if (start >= file.size()) continue;
    const char* name = reinterpret_cast<const char*>(file.data() + start);
    image.symbols[std::string(name, strnlen(name, file.size() - start))] =
        Symbol{static_cast<std::uint16_t>(symbol.st_value - kDataSpace),
               static_cast<std::uint16_t>(symbol.st_size)};
  }
}

Image load_elf(const std::string& path, const Bytes& file) {
  const auto header = read_at<Elf32_Ehdr>(path, file, 0);
  if (header.e_ident[EI_CLASS] != ELFCLASS32 || header.e_machine != kElfMachineAvr)
    fail(path, "an ELF file, but not for AVR");
  Image image;
  image.entry = header.e_entry;
  for (unsigned i = 0; i < header.e_phnum; ++i) {
    const auto segment =
        read_at<Elf32_Phdr>(path, file, header.e_phoff + i * std::size_t{header.e_phentsize});
    if (segment.p_type != PT_LOAD || segment.p_filesz == 0) continue;
    if (segment.p_offset > file.size() || file.size() - segment.p_offset < segment.p_filesz)
      fail(path, "ELF file cut short");
    const std::uint8_t* bytes = file.data() + segment.p_offset;
    if (segment.p_vaddr >= kEepromSpace && segment.p_vaddr < kEepromSpace + kEepromBytes) {
      Bytes eeprom(kEepromBytes, 0xFF);
      const std::uint32_t start = segment.p_vaddr - kEepromSpace;
      std::copy_n(bytes, std::min(segment.p_filesz, kEepromBytes - start), eeprom.begin() + start);
      image.eeprom = std::move(eeprom);
    } else if (segment.p_paddr < kDataSpace) {
      place(path, image, segment.p_paddr, bytes, segment.p_filesz);
    }
  }
  for (unsigned i = 0; i < header.e_shnum; ++i) {
    const auto at = [&](std::size_t k) {
      return read_at<Elf32_Shdr>(path, file, header.e_shoff + k * sizeof(Elf32_Shdr));
    };
    const Elf32_Shdr section = at(i);
    if (section.sh_type == SHT_SYMTAB && section.sh_link < header.e_shnum)
      load_elf_symbols(path, file, section, at(section.sh_link), image);
  }
  return image;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

/// One line ":LLAAAATT...CC" as bytes, its checksum verified.
Bytes hex_record(const std::string& where, const std::string& line) {
  if (line.size() < 11 || line[0] != ':' || line.size() % 2 == 0) fail(where, "not a hex record");
  Bytes record;
  std::uint8_t sum = 0;
  for (std::size_t i = 1; i < line.size(); i += 2) {
    const int high = hex_digit(line[i]), low = hex_digit(line[i + 1]);
    if (high < 0 || low < 0) fail(where, "not a hex digit");
    record.push_back(static_cast<std::uint8_t>(high * 16 + low));
    sum = static_cast<std::uint8_t>(sum + record.back());
  }
  if (sum != 0) fail(where, "wrong checksum");
  if (record.size() != 5u + record[0]) fail(where, "wrong length");
  return record;
}

Image load_hex(const std::string& path, const Bytes& file) {
  Image image;
  std::uint32_t base = 0, lowest = kFlashBytes;
  bool is_ended = false;
  unsigned line_number = 0;
  for (auto at = file.begin(); at != file.end() && !is_ended;) {
    const auto end = std::find(at, file.end(), '\n');
    std::string line(at, end);
    at = end == file.end() ? end : end + 1;
    ++line_number;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
    if (line.empty()) continue;
    const std::string where = path + ":" + std::to_string(line_number);
    const Bytes record = hex_record(where, line);
    const std::uint32_t address = record[1] * 256u + record[2];
    switch (record[3]) {
      case 0:
        place(where, image, base + address, record.data() + 4, record[0]);
        lowest = std::min(lowest, base + address);
        break;
      case 1:
        is_ended = true;
        break;
      case 2:
      case 4:
        if (record[0] != 2) fail(where, "wrong length");
        base = (record[4] * 256u + record[5]) << (record[3] == 2 ? 4 : 16);
        break;
      default:
        break;  // 3 and 5 set a start address of other processors
    }
  }
  if (!is_ended) fail(path, "hex file without an end record");
  if (lowest >= kBootloaderStart && lowest < kFlashBytes) image.entry = lowest;
  return image;
}

}  // namespace

void Image::add_bootloader(const Image& bootloader) {
  if (bootloader.flash[kBootloaderStart] == 0xFF && bootloader.flash[kBootloaderStart + 1] == 0xFF)
    throw std::runtime_error("not a bootloader: it has nothing at 0x7000");
  std::copy(bootloader.flash.begin() + kBootloaderStart, bootloader.flash.end(),
            flash.begin() + kBootloaderStart);
}

Image load_image(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) fail(path, "cannot be opened");
  const Bytes file{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (file.size() >= SELFMAG && std::memcmp(file.data(), ELFMAG, SELFMAG) == 0)
    return load_elf(path, file);
  if (!file.empty() && file[0] == ':') return load_hex(path, file);
  fail(path, "neither an ELF nor an Intel hex file");
}

}  // namespace swarmtalk::emulator
