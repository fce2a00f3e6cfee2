#include "emulation/kilobot/image.hpp"

#include <gelf.h>
#include <libelf.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>

#include "hex/intel_hex.hpp"

namespace swarmtalk::emulator {
namespace {

// avr-gcc's address spaces: data space at 0x800000, EEPROM at 0x810000.
constexpr std::uint32_t kDataSpace = 0x800000;
constexpr std::uint32_t kEepromSpace = 0x810000;

using Bytes = std::vector<std::uint8_t>;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(path + ": " + what);
}

void place(const std::string& path, Image& image, std::uint32_t address, const std::uint8_t* bytes,
           std::size_t size_bytes) {
  if (std::uint64_t{address} + size_bytes > kFlashBytes)
    fail(path, "code beyond the 32 KiB of flash");
  std::copy_n(bytes, size_bytes, image.flash.begin() + address);
  image.used_bytes += static_cast<std::uint32_t>(size_bytes);
}

struct EndElf {
  void operator()(Elf* elf) const { elf_end(elf); }
};
using ElfFile = std::unique_ptr<Elf, EndElf>;

void load_symbols(const ElfFile& elf, Elf_Scn* section, const GElf_Shdr& header, Image& image) {
  Elf_Data* const table = elf_getdata(section, nullptr);
  GElf_Sym symbol;
  for (int i = 0; gelf_getsym(table, i, &symbol) != nullptr; ++i) {
    const bool in_ram = symbol.st_value >= kDataSpace && symbol.st_value < kEepromSpace;
    const char* const name =
        in_ram ? elf_strptr(elf.get(), header.sh_link, symbol.st_name) : nullptr;
    if (name == nullptr) continue;
    image.symbols[name] = Symbol{static_cast<std::uint16_t>(symbol.st_value - kDataSpace),
                                 static_cast<std::uint16_t>(symbol.st_size)};
  }
}

void load_segment(const std::string& path, const Bytes& file, const GElf_Phdr& segment,
                  Image& image) {
  if (segment.p_offset > file.size() || file.size() - segment.p_offset < segment.p_filesz)
    fail(path, "ELF file cut short");
  const std::uint8_t* bytes = file.data() + segment.p_offset;
  if (segment.p_vaddr >= kEepromSpace && segment.p_vaddr < kEepromSpace + kEepromBytes) {
    Bytes eeprom(kEepromBytes, 0xFF);
    const std::size_t start = segment.p_vaddr - kEepromSpace;
    std::copy_n(bytes, std::min<std::size_t>(segment.p_filesz, kEepromBytes - start),
                eeprom.begin() + static_cast<std::ptrdiff_t>(start));
    image.eeprom = std::move(eeprom);
  } else if (segment.p_paddr < kDataSpace) {
    place(path, image, static_cast<std::uint32_t>(segment.p_paddr), bytes, segment.p_filesz);
  }
}

Image load_elf(const std::string& path, Bytes& file) {
  elf_version(EV_CURRENT);
  const ElfFile elf(elf_memory(reinterpret_cast<char*>(file.data()), file.size()));
  GElf_Ehdr header;
  std::size_t segments = 0;
  if (gelf_getehdr(elf.get(), &header) == nullptr || elf_getphdrnum(elf.get(), &segments) != 0)
    fail(path, "ELF file cut short");
  if (gelf_getclass(elf.get()) != ELFCLASS32 || header.e_machine != EM_AVR)
    fail(path, "an ELF file, but not for AVR");
  Image image;
  image.entry = static_cast<std::uint32_t>(header.e_entry);
  for (std::size_t i = 0; i < segments; ++i) {
    GElf_Phdr segment;
    if (gelf_getphdr(elf.get(), static_cast<int>(i), &segment) == nullptr)
      fail(path, "ELF file cut short");
    if (segment.p_type == PT_LOAD && segment.p_filesz > 0) load_segment(path, file, segment, image);
  }
  for (Elf_Scn* section = nullptr; (section = elf_nextscn(elf.get(), section)) != nullptr;) {
    GElf_Shdr table;
    if (gelf_getshdr(section, &table) != nullptr && table.sh_type == SHT_SYMTAB)
      load_symbols(elf, section, table, image);
  }
  return image;
}

/// JMP or RJMP, as at the reset vector of each program.
bool is_jump(int word) {
  return (word & 0xFE0E) == 0x940C || (word & 0xF000) == 0xC000;
}

Image load_hex(const std::string& path, const Bytes& file) {
  const hex::IntelHex hex =
      hex::parse_intel_hex({reinterpret_cast<const char*>(file.data()), file.size()});
  if (!hex.problem.empty()) fail(path, hex.problem);
  Image image;
  std::uint32_t lowest = kFlashBytes;
  for (const hex::Block& block : hex.blocks) {
    if (const std::string why = hex::beside_program_problem(block); !why.empty()) fail(path, why);
    const std::string where = path + ": line " + std::to_string(block.line);
    place(where, image, block.address, block.bytes.data(), block.bytes.size());
    lowest = std::min(lowest, block.address);
  }
  if (lowest >= kBootloaderStart && lowest < kFlashBytes) image.entry = lowest;
  // The whole flash of a robot that lost power while it was programmed may begin with anything.
  const bool may_be_eeprom = lowest == 0 && image.used_bytes <= kEepromBytes;
  if (may_be_eeprom && !is_jump(image.flash[0] | image.flash[1] << 8)) {
    fail(path, "does not begin with a jump, as every program of avr-gcc: is it EEPROM data?");
  }
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
  Bytes file{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (file.size() >= SELFMAG && std::memcmp(file.data(), ELFMAG, SELFMAG) == 0)
    return load_elf(path, file);
  return load_hex(path, file);
}

}  // namespace swarmtalk::emulator
