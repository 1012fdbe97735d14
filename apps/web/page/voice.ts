// Changes of behavior to hear: a short sound for each, or words. Off until asked for.

/** Notes of each behavior [Hz]: up for going, down for stopping, a turn for turning. */
const NOTES: Record<string, number[]> = {
  walk: [440, 660],
  stop: [440, 294],
  turn: [440, 554, 440],
  spin: [554, 440, 554],
  fallen: [220, 165, 110],
};
const NOTE_S = 0.11;

export class Voice {
  sounds = false;
  speech = false;
  private context: AudioContext | null = null;

  announce(words: string, behavior: string): void {
    if (this.sounds) this.play(NOTES[behavior] ?? []);
    if (this.speech && "speechSynthesis" in window) {
      speechSynthesis.cancel();
      speechSynthesis.speak(new SpeechSynthesisUtterance(words));
    }
  }

  private play(notes: number[]): void {
    this.context ??= new AudioContext();
    const { context } = this;
    notes.forEach((frequency, i) => {
      const [tone, gain] = [context.createOscillator(), context.createGain()];
      const at = context.currentTime + i * NOTE_S;
      tone.frequency.value = frequency;
      gain.gain.setValueAtTime(0.12, at);
      gain.gain.exponentialRampToValueAtTime(0.001, at + NOTE_S);
      tone.connect(gain).connect(context.destination);
      tone.start(at);
      tone.stop(at + NOTE_S);
    });
  }
}
