"""A link within one thread: whoever subscribes is called at once, late comers with what was kept."""

from collections import defaultdict


class LocalLink:
    def __init__(self):
        self.takers, self.kept = defaultdict(list), defaultdict(list)
        self.roles, self.watchers = set(), []

    def publisher(self, topic, keep=0):
        def publish(parts):
            if keep:
                self.kept[topic] = [*self.kept[topic], parts][-keep:]
            for take in list(self.takers[topic]):
                take(parts)

        return publish

    def subscribe(self, topic, take):
        self.takers[topic].append(take)
        for parts in list(self.kept[topic]):
            take(parts)
        return lambda: self.takers[topic].remove(take)

    def join(self, role):
        self.roles.add(role)
        for told in list(self.watchers):
            told(role, True)

    def leave(self, role):
        self.roles.discard(role)
        for told in list(self.watchers):
            told(role, False)

    def watch(self, told):
        self.watchers.append(told)
        for role in list(self.roles):
            told(role, True)

    def run(self, module):
        """Let a module hear and answer; what is given back kills it."""
        answer = self.publisher(module.says) if module.says else None

        def hear(topic, parts):
            if (said := module.hear(topic, parts)) is not None:
                answer(said)

        ends = [self.subscribe(topic, lambda parts, topic=topic: hear(topic, parts)) for topic in module.hears]
        self.join(module.role)

        def kill():
            for end in ends:
                end()
            self.leave(module.role)

        return kill
