"""A link within one process: whoever subscribes is called at once, late comers with what was kept."""

from collections import defaultdict


class Bus:
    def __init__(self):
        self.takers, self.kept = defaultdict(list), defaultdict(list)
        self.roles, self.watchers = set(), []

    def link(self):
        return LocalLink(self)

    def leave(self, role):
        self.roles.discard(role)
        for told in self.watchers:
            told(role, False)


class LocalLink:
    def __init__(self, bus):
        self.bus = bus

    def publisher(self, topic, keep=0):
        def publish(parts):
            self.bus.kept[topic] = [*self.bus.kept[topic], parts][-keep:] if keep else []
            for take in list(self.bus.takers[topic]):
                take(parts)

        return publish

    def subscribe(self, topic, take):
        self.bus.takers[topic].append(take)
        for parts in list(self.bus.kept[topic]):
            take(parts)
        return lambda: self.bus.takers[topic].remove(take)

    def join(self, role):
        self.bus.roles.add(role)
        for told in list(self.bus.watchers):
            told(role, True)

    def watch(self, told):
        self.bus.watchers.append(told)
        for role in list(self.bus.roles):
            told(role, True)
