#!/usr/bin/env python3
"""A switch between network interfaces that treats frames badly, by a seed: what netem would do, where the kernel has none.

    netns-switch.py [--loss P] [--delay MS] [--jitter MS] [--duplicate P] [--seed N] INTERFACE...
    netns-switch.py --plain INTERFACE...   switches checksum and segmentation offload off, so that copied frames are whole

Every frame goes to all other interfaces, as a hub's does, so that multicast and ARP work. Dice fall per frame and receiver. Needs root.
"""
import argparse
import fcntl
import heapq
import random
import select
import socket
import struct
import sys
import time

ETH_P_ALL = 3
SIOCETHTOOL = 0x8946
# ETHTOOL_STXCSUM, ETHTOOL_SSG, ETHTOOL_STSO, ETHTOOL_SUFO, ETHTOOL_SGSO
OFFLOADS = (0x17, 0x19, 0x1F, 0x22, 0x24)
PACKET_OUTGOING = 4


def plain(interface):
    """Asks the driver to compute nothing later: what is copied off the interface is then a whole frame."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as control:
        for command in OFFLOADS:
            value = bytearray(struct.pack("II", command, 0))
            import ctypes

            buffer = (ctypes.c_char * len(value)).from_buffer(value)
            request = struct.pack("16sQ", interface.encode(), ctypes.addressof(buffer))
            try:
                fcntl.ioctl(control, SIOCETHTOOL, request)
            except OSError:
                pass  # one that this driver does not have


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plain", action="store_true")
    parser.add_argument("--loss", type=float, default=0.0)
    parser.add_argument("--duplicate", type=float, default=0.0)
    parser.add_argument("--delay", type=float, default=0.0, help="ms")
    parser.add_argument("--jitter", type=float, default=0.0, help="ms, uniform from zero; frames may overtake each other")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("interfaces", nargs="+")
    options = parser.parse_args()
    if options.plain:
        for interface in options.interfaces:
            plain(interface)
        return 0

    ports = []
    for interface in options.interfaces:
        port = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(ETH_P_ALL))
        port.bind((interface, 0))
        port.setblocking(False)
        ports.append(port)
    dice = random.Random(options.seed)
    on_the_way, number = [], 0
    print("switching", flush=True)
    while True:
        wait = 0.5
        if on_the_way:
            wait = max(0.0, min(wait, on_the_way[0][0] - time.monotonic()))
        readable, _, _ = select.select(ports, [], [], wait)
        for source in readable:
            for _ in range(64):
                try:
                    frame, address = source.recvfrom(65535)
                except BlockingIOError:
                    break
                if address[2] == PACKET_OUTGOING:
                    continue
                now = time.monotonic()
                for target in ports:
                    if target is source or dice.random() < options.loss:
                        continue
                    for _ in range(1 + (dice.random() < options.duplicate)):
                        late = (options.delay + options.jitter * dice.random()) / 1000
                        number += 1
                        heapq.heappush(on_the_way, (now + late, number, target, frame))
        now = time.monotonic()
        while on_the_way and on_the_way[0][0] <= now:
            _, _, target, frame = heapq.heappop(on_the_way)
            try:
                target.send(frame)
            except OSError:
                pass  # its queue is full, or the frame too long: lost, as on a wire


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        pass
