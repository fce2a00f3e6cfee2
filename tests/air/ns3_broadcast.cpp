// The experiment of broadcast.hpp on the Wi-Fi model of ns-3 (https://www.nsnam.org, GPL-2.0): a
// judge of our medium, linked to nothing else and never installed.
#include <ns3/boolean.h>
#include <ns3/double.h>
#include <ns3/mobility-helper.h>
#include <ns3/mobility-model.h>
#include <ns3/node-container.h>
#include <ns3/packet.h>
#include <ns3/propagation-delay-model.h>
#include <ns3/propagation-loss-model.h>
#include <ns3/rng-seed-manager.h>
#include <ns3/simulator.h>
#include <ns3/string.h>
#include <ns3/wifi-net-device.h>
#include <ns3/wifi-phy.h>
#include <ns3/yans-wifi-channel.h>
#include <ns3/yans-wifi-helper.h>

#include <map>

#include "tests/air/broadcast.hpp"

namespace {

using namespace ns3;
using swarmtalk::tests::Experiment;
using swarmtalk::tests::kRangeM;

constexpr double kExponent = 3;
constexpr double kLossAtOneMetreDb = 46.6777;  // at 5.15 GHz
constexpr double kWeakestDbm = -82;            // that ns-3 receives by default
constexpr uint16_t kEtherType = 0x88B5;

struct Counts {
  const Experiment* experiment;
  std::map<Mac48Address, uint32_t> stations;
  std::vector<uint64_t> sent;
  uint64_t received = 0;
};

Ptr<YansWifiChannel> make_channel() {
  auto loss = CreateObject<LogDistancePropagationLossModel>();
  loss->SetAttribute("Exponent", DoubleValue(kExponent));
  loss->SetReference(1, kLossAtOneMetreDb);
  auto channel = CreateObject<YansWifiChannel>();
  channel->SetPropagationLossModel(loss);
  channel->SetPropagationDelayModel(CreateObject<ConstantSpeedPropagationDelayModel>());
  return channel;
}

NetDeviceContainer make_devices(const NodeContainer& nodes) {
  // So that the weakest frame comes from kRangeM away, and a rounding farther.
  const double power_dbm =
      kWeakestDbm + kLossAtOneMetreDb + 10 * kExponent * std::log10(kRangeM) + 0.001;
  YansWifiPhyHelper phy;
  phy.SetChannel(make_channel());
  phy.Set("TxPowerStart", DoubleValue(power_dbm));
  phy.Set("TxPowerEnd", DoubleValue(power_dbm));
  WifiHelper wifi;
  wifi.SetStandard(WIFI_STANDARD_80211a);
  wifi.SetRemoteStationManager("ns3::ConstantRateWifiManager", "DataMode",
                               StringValue("OfdmRate6Mbps"), "NonUnicastMode",
                               StringValue("OfdmRate6Mbps"));
  WifiMacHelper mac;
  mac.SetType("ns3::AdhocWifiMac", "QosSupported", BooleanValue(false));
  return wifi.Install(phy, mac, nodes);
}

void place(const Experiment& experiment, const NodeContainer& nodes) {
  auto places = CreateObject<ListPositionAllocator>();
  for (uint32_t station = 0; station < experiment.stations; ++station) {
    places->Add(Vector(experiment.x_m(station), experiment.y_m(station), 0));
  }
  MobilityHelper mobility;
  mobility.SetPositionAllocator(places);
  mobility.SetMobilityModel("ns3::ConstantPositionMobilityModel");
  mobility.Install(nodes);
}

void count_sent(Counts* counts, uint32_t station, Ptr<const Packet>, double) {
  ++counts->sent[station];
}

bool count_received(Counts* counts, uint32_t station, Ptr<NetDevice>, Ptr<const Packet>, uint16_t,
                    const Address& from) {
  const uint32_t sender = counts->stations.at(Mac48Address::ConvertFrom(from));
  counts->received += counts->experiment->are_in_range(sender, station);
  return true;
}

void send(Ptr<NetDevice> device, uint32_t bytes) {
  device->Send(Create<Packet>(bytes), device->GetBroadcast(), kEtherType);
}

}  // namespace

int main(int argc, char** argv) {
  const Experiment experiment = swarmtalk::tests::experiment(argc, argv);
  RngSeedManager::SetRun(experiment.seed);
  NodeContainer nodes;
  nodes.Create(experiment.stations);
  const NetDeviceContainer devices = make_devices(nodes);
  place(experiment, nodes);
  Counts counts;
  counts.experiment = &experiment;
  counts.sent.resize(experiment.stations);
  for (uint32_t station = 0; station < experiment.stations; ++station) {
    auto device = DynamicCast<WifiNetDevice>(devices.Get(station));
    counts.stations[Mac48Address::ConvertFrom(device->GetAddress())] = station;
    device->GetPhy()->TraceConnectWithoutContext("PhyTxBegin",
                                                 MakeBoundCallback(&count_sent, &counts, station));
    device->SetReceiveCallback(MakeBoundCallback(&count_received, &counts, station));
    for (const uint64_t at_us : experiment.moments(station)) {
      Simulator::Schedule(MicroSeconds(at_us), &send, Ptr<NetDevice>(device),
                          experiment.payload_bytes);
    }
  }
  Simulator::Stop(Seconds(experiment.seconds));
  Simulator::Run();
  Simulator::Destroy();
  swarmtalk::tests::print_result(experiment, counts.sent, counts.received);
  return 0;
}
