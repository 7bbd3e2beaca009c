"""One node of the ranging protocol, without a clock and without a radio.

The shell that owns the radio calls it when a preamble is detected, when a frame has arrived or
broken off, and when the `deadline` has come; the session answers with frames to send at exact
times and with events. All times are 40-bit stamps of the node's own radio clock. The rules:

- Messages follow each other with a gap in which everybody listens. Whoever is not a member of
  the round yet speaks right at its start; the member whose turn it is speaks at its end.
- The initiator's request names the members; they answer by rising ID. A slot in which no
  preamble is heard is over at once, unless others do hear that node: then it is waited out.
- Whoever hears a smaller ID follows it. Nodes that nobody heard for some rounds are dropped.
- If the initiator falls silent the next ID takes over (`succession`), or all are reset when
  their watchdog has run off, as in the paper.
"""

from __future__ import annotations

from enum import Enum

from tracking.errors import ConfigError, WireError
from tracking.ranging.events import (
    DuplicateId,
    MembersChanged,
    Output,
    Reception,
    Role,
    RoleChanged,
    Transmission,
)
from tracking.ranging.listening import Listener
from tracking.ranging.params import SessionParams
from tracking.ranging.slots import Slots
from tracking.ranging.timestamps import MODULUS, on_grid, ticks, unwrap
from tracking.ranging.wire import MAX_ID, Entry, Frame, Type, decode, encode, split

_BACK = ticks(1e-3)
"""A clock that goes back by more has jumped."""


class Waiting(Enum):
    """What the deadline is for."""

    START = "nobody may be there: become initiator"
    FRAME = "a frame is coming in"
    TURN = "own turn: speak if the gap stays silent"
    SLOT = "the slot is silent if no preamble comes"
    TAKEOVER = "the request is missing: take over"
    WATCHDOG = "begin anew"


class Session:
    """The state machine of one node.

    Laws: never an exception, whatever comes in; there is always a deadline, and every state is
    left when its deadline has come.
    """

    def __init__(self, node_id: int, params: SessionParams, *, boot: int) -> None:
        """Set a node up; nothing happens before `start`.

        Args:
            node_id: 0 to 254, unique in the group.
            params: How it takes part.
            boot: A random number, drawn anew whenever the node is switched on.

        Raises:
            ConfigError: An ID out of range.
        """
        if not 0 <= node_id <= MAX_ID:
            raise ConfigError(f"node id: expected 0 to {MAX_ID}, got {node_id}")
        self.id, self._params, self._boot = node_id, params, boot & 0xFF
        self._slots = Slots(params.phy)
        self._random = (boot * 2654435761 + node_id + 1) % (1 << 32)
        self._listener = Listener(node_id, params.exchange)
        self._peers = self._listener.peers
        self._out: list[Output] = []
        self._now = self._deadline = self._expected = self._heard_at = self._asked_at = 0
        self._sequence = self.round = self._cursor = 0
        self._check_at = self._attempts = self._backoff = 0
        self._tried_round: int | None = None
        self._rows: list[int] = []
        self._waiting = self._before = Waiting.START
        self._early = False
        self._held_deadline = 0
        self.role, self.root = Role.LISTENING, node_id
        self.members: tuple[int, ...] = (node_id,)

    @property
    def deadline(self) -> int:
        """When `timeout` is to be called, 40-bit stamp."""
        return self._deadline % MODULUS

    def start(self, now: int) -> list[Output]:
        """Switch on."""
        self._now = now
        self._begin()
        return self._give()

    def preamble(self, now: int) -> list[Output]:
        """A preamble was detected: `frame` or `broken` will follow."""
        if self._advance(now) and self.role is not Role.MUTED:
            if self._waiting is not Waiting.FRAME:
                self._before, self._held_deadline = self._waiting, self._deadline
            self._early = self._now < self._expected - self._slots.header
            self._waiting = Waiting.FRAME
            self._deadline = self._now + self._slots.longest + self._slots.header
        return self._give()

    def broken(self, now: int) -> list[Output]:
        """What came in was no frame."""
        if self._advance(now) and self._waiting is Waiting.FRAME:
            self._unreadable()
        return self._give()

    def frame(self, data: bytes, reception: Reception, now: int) -> list[Output]:
        """A frame came in.

        Args:
            data: Its bytes.
            reception: What the radio tells of it.
            now: Stamp of this moment.
        """
        if not self._advance(now) or self.role is Role.MUTED:
            return self._give()
        if self._waiting is not Waiting.FRAME:
            self._before, self._held_deadline = self._waiting, self._deadline
        arrived = unwrap(reception.stamp, self._now) - self._params.antenna_delay
        try:
            heard = decode(data)
        except WireError:
            heard = None
        on_time = 0 <= self._now - arrived <= self._slots.longest + self._slots.header
        if heard is None or heard.pan != self._params.pan or not on_time:
            self._unreadable()
        elif heard.src == self.id:
            self._own_id(heard, arrived, len(data))
        else:
            self._hear(heard, reception, arrived, len(data))
        return self._give()

    def timeout(self, now: int) -> list[Output]:
        """The deadline has come."""
        if not self._advance(now) or self._now < self._deadline:
            return self._give()
        if self._waiting is Waiting.FRAME:
            self._unreadable()
        elif self._waiting is Waiting.TURN:
            self._speak(max(self._expected, self._now + self._slots.header))
        elif self._waiting is Waiting.SLOT:
            self._silent_slot()
        elif self._waiting is Waiting.WATCHDOG:
            self._begin()
        else:
            self._become_initiator()
        return self._give()

    # Whose turn it is ---------------------------------------------------------------------

    def _await_slot(self) -> None:
        """Set the deadline for the slot at the cursor."""
        s, at_request = self._slots, self._cursor >= len(self.members)
        leads = self.role is Role.INITIATOR
        mine = leads if at_request else self.members[self._cursor] == self.id
        if mine and not leads and self._now >= self._check_at:
            self._check_at, mine = self._now + self._draw(self._params.check), False
        if mine:
            self._waiting = Waiting.TURN
            self._deadline = self._expected - s.header - s.turnaround
        else:
            self._waiting = Waiting.SLOT
            self._deadline = self._expected - s.header + s.sense

    def _silent_slot(self) -> None:
        """No preamble in the slot at the cursor."""
        n, since = len(self.members), self._now - 2 * self._round_time()
        at_request = self._cursor >= n
        node = self.root if at_request else self.members[self._cursor]
        hidden = node != self.id and self._peers.hidden(node, since)
        if at_request and not hidden:
            self._request_missing()
            return
        self._expected += self._slots.message(n) if hidden else self._slots.silent
        if at_request:  # others hear the initiator: its request went past here
            self.round = (self.round + 1) % 256
        self._cursor = 1 if at_request else self._cursor + 1
        self._await_slot()

    def _request_missing(self) -> None:
        """The initiator is silent: wait for one's place in the line of succession."""
        self._waiting = Waiting.WATCHDOG
        self._deadline = self._heard_at + ticks(self._params.watchdog)
        heirs = [k for k in self.members if k != self.root]
        if self._params.succession and self.id in heirs:
            patience = self._params.takeover * (heirs.index(self.id) + 1)
            takeover = self._expected + int(patience * self._slots.message(len(self.members)))
            if takeover < self._deadline:
                self._waiting, self._deadline = Waiting.TAKEOVER, takeover

    def _become_initiator(self) -> None:
        """Start rounds of one's own: nobody else does."""
        members = tuple(k for k in self.members if k != self.root or k == self.id)
        self._set_role(Role.INITIATOR, self.id)
        self._set_members(members)
        self._cursor, self._asked_at = len(members), self._now
        self._speak(self._now + self._slots.turnaround + self._slots.header)

    def _next_members(self) -> tuple[int, ...]:
        """Members of the initiator's next round: who was heard in the last one stays or joins."""
        members = set(self.members)
        for k, peer in self._peers:
            if self._peers.alive(k, self._asked_at):
                peer.missed = 0
                members.add(k)
            else:
                peer.missed += 1
                if peer.missed >= self._params.drop_after:
                    members.discard(k)
        return tuple(sorted(members))

    # Speaking -----------------------------------------------------------------------------

    def _speak(self, at: int) -> None:
        """Send the own message, its first stamp moment at or after the given time."""
        kind = Type.REPLY if self.id in self.members else Type.JOIN
        if self.role is Role.INITIATOR:
            self._set_members(self._next_members())
            self.round, self._cursor, self._asked_at = (self.round + 1) % 256, 0, at
            kind = Type.REQUEST
        rows = self._peers.table(tuple(k for k in self.members if k != self.id))
        parts = split(rows, self._params.phy.max_frame)
        sent = at
        for p, entries in enumerate(parts):
            at = on_grid(at)
            sent = at + self._params.antenna_delay
            length = self._send(kind, at, self._cursor, len(self.members), entries, p, len(parts))
            at += self._slots.frame(length) + self._slots.gap
        self._listener.spoken(sent)
        self._expected = at
        if kind is not Type.JOIN:
            self._cursor += 1
        if len(self.members) == 1 and self.role is Role.INITIATOR:
            self._expected += ticks(self._params.idle)
        self._await_slot()

    def _send(
        self, kind: Type, at: int, slot: int, n: int, entries: tuple[Entry, ...] = (),
        part: int = 0, parts: int = 1,
    ) -> int:
        """Hand one frame out and return its length in bytes."""
        stamp = (at + self._params.antenna_delay) % MODULUS
        frame = Frame(
            kind, self.id, self.root, self.round, slot, n, self._boot, stamp, entries,
            self._params.pan, self._sequence, part, parts,
        )  # fmt: skip
        data = encode(frame)
        self._sequence = (self._sequence + 1) % 256
        self._out.append(Transmission(data, at % MODULUS))
        return len(data)

    def _insert(self, at: int) -> None:
        """A newcomer speaks at the start of the gap, once a round and after drawn pauses."""
        if self.round == self._tried_round:
            return
        if self._backoff > 0:
            self._backoff -= 1
            return
        self._attempts = min(self._attempts + 1, 6)
        self._backoff = self._next_random() % (1 << self._attempts)
        self._tried_round = self.round
        self._check_at = self._now + self._draw(self._params.first_check)
        if self.id < self.root:
            self._set_role(Role.INITIATOR, self.id)
        self._speak(at)

    # Hearing ------------------------------------------------------------------------------

    def _hear(self, heard: Frame, reception: Reception, arrived: int, length: int) -> None:
        """Take a valid frame of another node, and one's place in the round that it tells."""
        lost = self._before in (Waiting.TAKEOVER, Waiting.WATCHDOG, Waiting.START)
        if self.role is Role.LISTENING and heard.root == self.id:
            self._waiting, self._deadline = self._before, self._held_deadline
            return  # an answer to who had this ID before
        if heard.root > self.root and not lost:
            self._unreadable()  # of a group that will follow this one once it hears it
            return
        events = self._listener.take(heard, reception, arrived)
        if events is None:
            self._unreadable()
            return
        self._out += events
        self._heard_at = self._now
        if heard.root != self.id:
            self._set_role(Role.RESPONDER, heard.root)
            self.round = heard.round
            self._learn_members(heard)
        whole = heard.part + 1 == heard.parts
        speaks_in_turn = heard.type in (Type.REQUEST, Type.REPLY)
        self._cursor = heard.slot + 1 if whole and speaks_in_turn else heard.slot
        end = arrived + self._slots.frame(length)
        self._expected = end + self._slots.gap
        self._await_slot()
        if whole and self.id not in self.members:
            self._insert(end + self._slots.turnaround)

    def _learn_members(self, heard: Frame) -> None:
        """Take the members of the round from a table, once all its parts were heard."""
        if heard.type is Type.ALERT:
            return
        ids = [e.id for e in heard.entries]
        self._rows = ids if heard.part == 0 else self._rows + ids
        others = heard.n if heard.type is Type.JOIN else heard.n - 1
        if heard.part + 1 == heard.parts and len(self._rows) >= others:
            members = self._rows[:others]
            if heard.type is not Type.JOIN:
                members.append(heard.src)
            self._set_members(tuple(sorted(set(members))))

    def _own_id(self, heard: Frame, arrived: int, length: int) -> None:
        """Another node uses this node's ID: report it, tell it, and keep silent for a while."""
        if heard.boot == self._boot:
            self._unreadable()  # an echo
            return
        self._out.append(DuplicateId(self.id, heard.boot))
        if heard.type is Type.ALERT:
            self._unreadable()
            return
        self.root, self.round = heard.root, heard.round
        at = on_grid(arrived + self._slots.frame(length) + self._slots.turnaround)
        self._send(Type.ALERT, at, min(heard.slot + 1, heard.n), heard.n)
        self._forget()
        self._set_role(Role.MUTED, self.id)
        self._waiting = Waiting.WATCHDOG
        self._deadline = self._now + self._draw(self._params.mute)

    def _unreadable(self) -> None:
        """Time went by with something on the air that tells nothing."""
        if self.role is Role.LISTENING:
            self._listen()
            return
        self._expected = self._now + self._slots.gap + self._slots.header
        if self._before in (Waiting.TAKEOVER, Waiting.WATCHDOG):
            self._request_missing()
            return
        if not self._early:
            at_request = self._cursor >= len(self.members)
            self._cursor = 1 if at_request and self.role is Role.RESPONDER else self._cursor + 1
        self._await_slot()

    # Beginning ----------------------------------------------------------------------------

    def _begin(self) -> None:
        """Begin anew: listen before speaking."""
        self._forget()
        self._set_role(Role.LISTENING, self.id)
        self._asked_at = self._heard_at = self._now
        self._check_at = self._attempts = self._backoff = 0
        self._tried_round = None
        self._listen()

    def _listen(self) -> None:
        self._waiting = Waiting.START
        self._deadline = self._now + self._draw(self._params.listen)

    def _forget(self) -> None:
        self._listener.forget()
        self._set_members((self.id,))

    def _set_role(self, role: Role, root: int) -> None:
        if (role, root) != (self.role, self.root):
            self.role, self.root = role, root
            self._out.append(RoleChanged(role, root))

    def _set_members(self, members: tuple[int, ...]) -> None:
        if members != self.members:
            before, after = set(self.members), set(members)
            joined, left = tuple(sorted(after - before)), tuple(sorted(before - after))
            self.members = members
            self._out.append(MembersChanged(members, joined, left))

    # Time and chance ----------------------------------------------------------------------

    def _advance(self, now: int) -> bool:
        """Take the time; False if the clock has jumped back, and the node begins anew."""
        time = unwrap(now, self._now)
        jumped = time < self._now - _BACK
        self._now = time if jumped else max(time, self._now)
        if jumped:
            self._begin()
        return not jumped

    def _round_time(self) -> int:
        n = len(self.members)
        return n * self._slots.message(n)

    def _draw(self, interval: tuple[float, float]) -> int:
        """A random duration [ticks]."""
        low, high = ticks(interval[0]), ticks(interval[1])
        return low + self._next_random() * (high - low) // (1 << 32)

    def _next_random(self) -> int:
        """32 random bits, by the generator of Numerical Recipes, section 7.1."""
        self._random = (1664525 * self._random + 1013904223) % (1 << 32)
        return self._random

    def _give(self) -> list[Output]:
        out, self._out = self._out, []
        return out
