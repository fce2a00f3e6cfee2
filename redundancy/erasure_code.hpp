// A systematic Reed-Solomon code over the packets of one message: parity packets of which any n
// make up for any n packets that were lost. The code's matrix is a Cauchy matrix whose columns are
// scaled so that the first row is all ones: the first parity packet is the XOR of all packets.
// Source: Bloemer et al., "An XOR-Based Erasure-Resilient Coding Scheme", ICSI TR-95-048, 1995.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace swarmtalk::redundancy {

using Bytes = std::vector<std::uint8_t>;

/// Packets of a message, and parity packets, are numbered below this each.
inline constexpr unsigned kMostOfAKind = 128;

/// What a packet is multiplied with in a parity packet. @pre both below kMostOfAKind
std::uint8_t coefficient(unsigned parity, unsigned source);

/// to[i] += factor * from[i]. @pre `to` is at least as long
void add_product(std::span<std::uint8_t> to, std::span<const std::uint8_t> from,
                 std::uint8_t factor);

struct Parity {
  unsigned index = 0;  // which of the message's
  Bytes bytes;
};

/// Works out the packets that are missing.
/// @param sources   payloads of the message's packets in order; one without data is missing. A
///                  shorter one counts as if zeros followed
/// @param parities  different ones, all of one length: that of the longest packet
/// @return the missing ones in order, each of the parities' length; empty if there are fewer
///         parities than are missing, or nothing is
std::vector<Bytes> recover(std::span<const std::span<const std::uint8_t>> sources,
                           std::span<const Parity> parities);

}  // namespace swarmtalk::redundancy
