// The page is for playing, or for watching a training whose server says so in the address.

import { play } from "./play.ts";
import { watch } from "./watch.ts";

if (new URLSearchParams(location.search).has("watch")) void watch();
else play();
