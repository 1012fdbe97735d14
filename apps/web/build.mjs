// Bundles the page's two scripts into dist/; `cargo run -p xtask -- web` calls this and adds the rest.
import { build } from "esbuild";

await build({
  entryPoints: { page: "page/main.ts", worker: "page/worker.ts" },
  outdir: "dist",
  bundle: true,
  format: "esm",
  target: "es2022",
  minify: true,
  legalComments: "eof",
  logLevel: "warning",
});
